#pragma once
/// Artifacts as files named by their sha256: DIRECTORY/ab/abcdef... (durable_file.h).

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include "server/queue/artifact_store.h"
#include "server/queue/disk_health.h"

namespace storage::files {

/// One process at a time (SqliteStores locks the data directory). A removal is not synced, so power loss may restore an
/// artifact that no job names.
class FileArtifactStore final : public queue::ArtifactStore {
 public:
  /// Creates the directories where missing and deletes incomplete files. Throws StoreFailure. `health` is that of the
  /// disk; null: private to this store.
  explicit FileArtifactStore(std::string directory, queue::DiskHealth* health = nullptr);

  Stored put(int fd, bool durable = true) override;
  void sync(const std::string& sha256) override;
  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256) override;
  void remove(const std::string& sha256) override;

 private:
  Stored store(int fd, bool durable);
  void sync_existing(const std::string& sha256);

  std::string directory_;
  queue::DiskHealth own_health_;
  queue::DiskHealth& health_;
  std::atomic<std::uint64_t> temporary_count_{0};
};

}  // namespace storage::files
