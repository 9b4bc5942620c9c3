#pragma once
/// Artifacts and uploaded assets that several nodes share, over an ObjectStore for the bytes and an ObjectIndex for
/// what may be removed.

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/queue/artifact_store.h"
#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/storage/files/durable_file.h"
#include "server/storage/objects/object_index.h"
#include "server/storage/objects/object_store.h"

namespace storage::objects {

/// Every put is durable, and replaces an object with other bytes. `remove` keeps what was stored or kept within the
/// `grace`; `collect` removes it later. The bytes of an object of up to small_bytes are compared with its name by
/// `open`, those of a larger one while it is read from its first byte to its last: the last read then throws
/// StoreFailure of kind `damaged`, and the next `open` returns null.
class SharedArtifactStore final : public queue::ArtifactStore {
 public:
  /// A node may take so long from the put of an image to the row of its job, with the database down meanwhile.
  static constexpr std::chrono::milliseconds default_grace = std::chrono::hours(24);

  SharedArtifactStore(ObjectStore& objects, ObjectIndex& index, queue::Clock clock,
                      std::chrono::milliseconds grace = default_grace);

  Stored put(int fd, bool durable = true) override;
  void keep(const std::string& sha256) override;
  void sync(const std::string& /*sha256*/) override {}
  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256, bool verified = true) override;
  void remove(const std::string& sha256) override;

  /// Removes the objects of one part (0 <= `part` < queue::AssetStore::parts) that no job names, and returns their
  /// number.
  int collect(int part);

 private:
  ObjectStore& objects_;
  ObjectIndex& index_;
  queue::Clock clock_;
  std::chrono::milliseconds grace_;
  files::NameSet damaged_{10'000};  ///< objects whose bytes were found to be others
};

class SharedAssetStore final : public queue::AssetStore {
 public:
  /// `bytes_max`: of all assets together.
  SharedAssetStore(ObjectStore& objects, ObjectIndex& index, queue::Clock clock, std::uint64_t bytes_max = INT64_MAX);

  Put put(const std::string& sha256, const Read& read) override;
  std::uint64_t bytes() override { return index_.bytes(); }
  bool use(const std::string& sha256) override;
  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256) override;
  std::vector<std::string> unused_since(int part, std::int64_t then) override;
  bool remove_unused_since(const std::string& sha256, std::int64_t then) override;

 private:
  ObjectStore& objects_;
  ObjectIndex& index_;
  queue::Clock clock_;
  const std::uint64_t bytes_max_;
};

/// Adds the next objects after the name `after` to the index, where a backup of the database that was restored does not
/// have them, so that they are collected. Returns the name to continue after; empty at the end.
std::string adopt_objects(ObjectStore& objects, ObjectIndex& index, const std::string& after, std::int64_t now);

}  // namespace storage::objects
