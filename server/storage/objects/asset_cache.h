#pragma once
/// Copies of assets on the disk of a node, from which its worker reads them.

#include <cstdint>
#include <mutex>
#include <string>

#include "server/queue/asset_store.h"
#include "server/support/descriptor.h"

namespace storage::objects {

/// Files DIRECTORY/ab/abcdef... of up to `bytes_max` together, then the ones that were opened least recently are
/// deleted. Thread-safe. Throws StoreFailure.
class AssetCache {
 public:
  /// Uses the files of an earlier run. `assets` must outlive it.
  AssetCache(std::string directory, std::uint64_t bytes_max, queue::AssetStore& assets);

  /// The asset, opened for reading; fetched first where it is not here, and compared with its name then. An empty
  /// descriptor where there is no such asset. Valid although the file is deleted meanwhile.
  support::Descriptor open(const std::string& sha256);

 private:
  bool fetch(const std::string& sha256);
  void make_room();

  const std::string directory_;
  const std::uint64_t bytes_max_;
  queue::AssetStore& assets_;
  std::mutex mutex_;         ///< guards the next
  std::uint64_t bytes_ = 0;  ///< size of all files
};

}  // namespace storage::objects
