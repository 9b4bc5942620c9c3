#pragma once
/// The embedded stores of artifacts and uploaded assets: files named by their sha256, DIRECTORY/ab/abcdef...
/// (durable_file.h).

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/queue/artifact_store.h"
#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/disk_health.h"
#include "server/storage/files/durable_file.h"

namespace storage::files {

/// Artifacts. One process at a time (SqliteStores locks the data directory). A removal is not synced, so power loss may
/// restore an artifact that no job names.
class FileArtifactStore final : public queue::ArtifactStore {
 public:
  /// Creates the directories where missing and deletes incomplete files. Throws StoreFailure. `health` is that of the
  /// disk; null: private to this store.
  explicit FileArtifactStore(std::string directory, queue::DiskHealth* health = nullptr);

  Stored put(int fd, bool durable = true) override;
  void sync(const std::string& sha256) override;
  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256, bool verified = true) override;
  void remove(const std::string& sha256) override;

  struct Scrubbed {
    Stored artifact;
    bool damaged = false;
  };
  /// Compares the bytes of one artifact with its name, in endless rounds; none at the end of a round. `open` then reads
  /// a damaged one again. One thread.
  std::optional<Scrubbed> scrub();

 private:
  Stored store(int fd, bool durable);

  std::string directory_;
  queue::DiskHealth own_health_;
  queue::DiskHealth& health_;
  NameSet verified_{100'000};             ///< artifacts whose bytes were compared
  int scrub_part_ = 0;                    ///< the next one
  std::vector<std::string> scrub_names_;  ///< the rest of the part before
};

/// Uploaded assets (queue::asset_path). The time of last use is stored as the modification time. One process at a time,
/// as FileArtifactStore. Uses and removals are not synced: power loss may restore an older time
/// of use (jobs still keep the assets that they name), or an asset that no job names.
class FileAssetStore final : public queue::AssetStore {
 public:
  /// Creates the directories where missing and deletes incomplete files. Throws StoreFailure. `bytes_max`: of all
  /// assets together. `health` is that of the disk; null: private to this store.
  FileAssetStore(std::string directory, queue::Clock clock, std::uint64_t bytes_max = UINT64_MAX,
                 queue::DiskHealth* health = nullptr);

  Put put(const std::string& sha256, const Read& read) override;
  std::uint64_t bytes() override { return bytes_; }
  bool use(const std::string& sha256) override;
  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256) override;
  std::vector<std::string> unused_since(int part, std::int64_t then) override;
  bool remove_unused_since(const std::string& sha256, std::int64_t then) override;

 private:
  Put store(const std::string& sha256, const Read& read);
  Put name(TemporaryFile& temporary, const queue::ArtifactStore::Stored& stored);

  std::string directory_;
  queue::Clock clock_;
  const std::uint64_t bytes_max_;
  std::atomic<std::uint64_t> bytes_{0};
  queue::DiskHealth own_health_;
  queue::DiskHealth& health_;
  /// Held over the check of the last use and the deletion, and over the check of the size and the rename.
  std::mutex mutex_;
};

}  // namespace storage::files
