#pragma once
/// Artifacts as files named by their sha256: DIRECTORY/ab/abcdef..., written to DIRECTORY/tmp, synced, then renamed.

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "server/queue/artifact_store.h"
#include "server/queue/disk_health.h"

namespace queue {

/// One process at a time (SqliteJobStore's lock on the data directory sees to that). Bytes that put returned for
/// survive kill -9 and power loss; remove is not synced, so power loss may bring bytes back that nobody names.
class FileArtifactStore final : public ArtifactStore {
 public:
  /// Creates the directories where missing and deletes what a dead process left half-written. Throws StoreFailure.
  /// `health` is that of the disk; null: nobody else is to know.
  explicit FileArtifactStore(std::string directory, DiskHealth* health = nullptr);

  Stored put(int fd, std::size_t small_bytes = 0) override;
  std::unique_ptr<ArtifactReader> open(const std::string& sha256) override;  ///< null for what is no sha256, too
  void remove(const std::string& sha256) override;

 private:
  Stored store(int fd);

  std::string directory_;
  DiskHealth own_health_;
  DiskHealth& health_;
  std::atomic<std::uint64_t> temporary_count_{0};
};

}  // namespace queue
