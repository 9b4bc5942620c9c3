#pragma once
/// Uploaded assets as files named by their sha256: FOLDER/ab/abcdef... (jobs::asset_path). The time of a file's last
/// change is that of its last use.

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "server/jobs/asset_store.h"
#include "server/jobs/clock.h"

namespace jobs {

/// One process at a time, as FileArtifactStore. What put answered survives kill -9 and power loss. Uses and removals
/// are not synced: power loss may take an asset back to an older use (the jobs that name it keep it all the same), or
/// bring one back that nobody names.
class FileAssetStore final : public AssetStore {
 public:
  /// Creates the folders where missing and deletes what a dead process left half-written. Throws StoreFailure.
  FileAssetStore(std::string folder, Clock clock);

  Put put(const std::string& sha256, const Read& read) override;
  bool use(const std::string& sha256) override;
  std::unique_ptr<ArtifactReader> open(const std::string& sha256) override;
  std::vector<std::string> unused_since(int part, std::int64_t then) override;
  bool remove_unused_since(const std::string& sha256, std::int64_t then) override;

 private:
  std::string folder_;
  Clock clock_;
  std::atomic<std::uint64_t> temporary_count_{0};
  std::mutex mutex_;  ///< held over "when was it used?" and the deletion, so that no use falls between
};

}  // namespace jobs
