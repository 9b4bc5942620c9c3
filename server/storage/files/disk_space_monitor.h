#pragma once
/// Watches how full the disk is on which the data directory lies, and keeps a ballast there: a file of no use but that
/// giving it up makes room. On a disk that is really full not even deleting works, for that is a write to the database.
///
///   queue::DiskSpaceMonitor disk(directory, settings, log);    // before the stores: they need room to open
///   queue.set_disk_probe([&] { return disk.now(); });
///   ... every half a second: if (disk.look()) queue.on_disk_space_available();

#include <cstdint>
#include <mutex>
#include <string>

#include "server/queue/disk_space.h"
#include "server/queue/event_log.h"

namespace queue {

struct DiskRoomSettings {
  /// Below this nothing new is accepted; a tenth of the disk where that is less. 10 GiB are a thousand large images.
  std::uint64_t reserve_bytes = 10ull << 30;
  /// Room for the rows and the images of what runs when the disk is full; a 32nd of the disk where that is less.
  std::uint64_t ballast_bytes = 64ull << 20;
};

/// Thread-safe.
class DiskSpaceMonitor {
 public:
  /// Makes `directory` where missing. Looks at once: takes the ballast, or gives up one that is there.
  DiskSpaceMonitor(const std::string& directory, const DiskRoomSettings& settings, Log log);

  /// Looks at the disk. With less than a quarter of the ballast free that is given up, and with twice of it taken
  /// again. True when there was no room before and is now. Throws StoreFailure where the disk cannot be looked at.
  bool look();

  [[nodiscard]] DiskSpace now() const;  ///< as it was at the last look

 private:
  [[nodiscard]] bool has_ballast() const;
  bool take_ballast(std::uint64_t bytes);

  const std::string directory_, ballast_;
  const DiskRoomSettings settings_;
  const Log log_;
  mutable std::mutex mutex_;
  DiskSpace room_;
};

}  // namespace queue
