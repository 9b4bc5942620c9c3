#pragma once
/// Artifacts as files named by their sha256: FOLDER/ab/abcdef..., written to FOLDER/tmp, synced, then renamed.

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "server/jobs/artifact_store.h"
#include "server/jobs/disk_health.h"

namespace jobs {

/// One process at a time (SqliteJobStore's lock on the data folder sees to that). Bytes that put returned for survive
/// kill -9 and power loss; remove is not synced, so power loss may bring bytes back that nobody names.
class FileArtifactStore final : public ArtifactStore {
 public:
  /// Creates the folders where missing and deletes what a dead process left half-written. Throws StoreFailure.
  /// `health` is that of the disk; null: nobody else is to know.
  explicit FileArtifactStore(std::string folder, DiskHealth* health = nullptr);

  Stored put(int fd, std::size_t small_bytes = 0) override;
  std::unique_ptr<ArtifactReader> open(const std::string& sha256) override;  ///< null for what is no sha256, too
  void remove(const std::string& sha256) override;

 private:
  Stored store(int fd);

  std::string folder_;
  DiskHealth own_health_;
  DiskHealth& health_;
  std::atomic<std::uint64_t> temporary_count_{0};
};

}  // namespace jobs
