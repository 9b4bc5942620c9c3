#pragma once
/// The store of uploaded files that scenes name by their sha256: immutable bytes, kept as long as a job names them and
/// for some time after their last use (collect_assets). Thread-safe. Fails with StoreFailure; then the call had no
/// effect.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/queue/artifact_store.h"

namespace queue {

/// Path of an asset relative to the directory of a store of files; the worker reads it there. Precondition: `sha256` is
/// 64 hex digits.
inline std::string asset_path(const std::string& sha256) { return sha256.substr(0, 2) + "/" + sha256; }

class AssetStore {
 public:
  virtual ~AssetStore() = default;

  /// Reads up to `size` bytes of the source at `offset`; fewer only at the end. Its exceptions pass through.
  using Read = std::function<std::size_t(std::uint64_t offset, char* into, std::size_t size)>;
  enum class Put { stored, was_there, other_bytes, quota_exceeded };
  /// Stores bytes under their name, used now. Durable when it returns; never visible half-written. `other_bytes`: the
  /// name is not their sha256, and nothing was stored. `quota_exceeded`: the store would exceed its limit, and nothing
  /// was stored.
  virtual Put put(const std::string& sha256, const Read& read) = 0;

  virtual std::uint64_t bytes() = 0;  ///< size of all assets

  /// Marks an asset as used now. False where it does not exist.
  virtual bool use(const std::string& sha256) = 0;

  virtual std::unique_ptr<ArtifactReader> open(
      const std::string& sha256) = 0;  ///< null when it does not exist; does not mark it

  // ---- for the collector

  static constexpr int parts = 256;
  /// The assets of one part (0 <= `part` < parts) whose last use was before `then`, in any order.
  virtual std::vector<std::string> unused_since(int part, std::int64_t then) = 0;
  /// Removes an asset unless it was used at or after `then`. False when it stays or does not exist.
  virtual bool remove_unused_since(const std::string& sha256, std::int64_t then) = 0;
};

}  // namespace queue
