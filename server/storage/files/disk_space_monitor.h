#pragma once
/// Monitors the free space on the disk of the data directory and keeps a ballast there: a file whose deletion frees
/// space. On a really full disk not even jobs could be deleted, because that is a write to the database.
///
///   queue::DiskSpaceMonitor disk(directory, settings, log);    // before the stores: they need room to open
///   settings.disk_space = [&] { return disk.now(); };          // queue::QueueSettings
///   ... every half a second: if (disk.measure()) queue.lifecycle.on_disk_space_available();

#include <cstdint>
#include <mutex>
#include <string>

#include "server/queue/disk_health.h"
#include "server/queue/event_log.h"

namespace storage::files {

struct DiskSpaceSettings {
  /// With less free space submissions are rejected; at most a tenth of the disk. 10 GiB are a thousand large images.
  std::uint64_t reserve_bytes = 10ull << 30;
  /// Space for the rows and images of running jobs on a full disk; at most a 32nd of the disk.
  std::uint64_t ballast_bytes = 64ull << 20;
};

/// Thread-safe.
class DiskSpaceMonitor {
 public:
  /// Creates `directory` where missing and measures: creates the ballast, or deletes an existing one.
  DiskSpaceMonitor(const std::string& directory, const DiskSpaceSettings& settings, queue::Log log);

  /// Measures the free space. With less than a quarter of the ballast free the ballast is deleted, and with twice of it
  /// created again. True when jobs could not be claimed before and can now. Throws StoreFailure.
  bool measure();

  [[nodiscard]] queue::DiskSpace now() const;  ///< at the last measurement

 private:
  bool create_ballast(std::uint64_t bytes);

  const std::string directory_, ballast_;
  const DiskSpaceSettings settings_;
  const queue::Log log_;
  mutable std::mutex mutex_;
  queue::DiskSpace space_;
};

}  // namespace storage::files
