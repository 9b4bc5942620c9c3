#pragma once
/// Uploaded assets as files named by their sha256: DIRECTORY/ab/abcdef... (queue::asset_path). The time of a file's
/// last change is that of its last use.

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/disk_health.h"

namespace queue {

namespace files {
class TemporaryFile;
}

/// One process at a time, as FileArtifactStore. What put answered survives kill -9 and power loss. Uses and removals
/// are not synced: power loss may take an asset back to an older use (the jobs that name it keep it all the same), or
/// bring one back that nobody names.
class FileAssetStore final : public AssetStore {
 public:
  /// Creates the directories where missing and deletes what a dead process left half-written. Throws StoreFailure.
  /// `bytes_max`: of all assets together. `health` is that of the disk; null: nobody else is to know.
  FileAssetStore(std::string directory, Clock clock, std::uint64_t bytes_max = UINT64_MAX,
                 DiskHealth* health = nullptr);

  Put put(const std::string& sha256, const Read& read) override;
  std::uint64_t bytes() override { return bytes_; }
  bool use(const std::string& sha256) override;
  std::unique_ptr<ArtifactReader> open(const std::string& sha256) override;
  std::vector<std::string> unused_since(int part, std::int64_t then) override;
  bool remove_unused_since(const std::string& sha256, std::int64_t then) override;

 private:
  Put store(const std::string& sha256, const Read& read);
  Put name(files::TemporaryFile& temporary, const ArtifactStore::Stored& stored);

  std::string directory_;
  Clock clock_;
  const std::uint64_t bytes_max_;
  std::atomic<std::uint64_t> bytes_{0};
  DiskHealth own_health_;
  DiskHealth& health_;
  std::atomic<std::uint64_t> temporary_count_{0};
  /// Held over "when was it used?" and the deletion, so that no use falls between; over "is there room?" and the
  /// naming.
  std::mutex mutex_;
};

}  // namespace queue
