#pragma once
/// A place for immutable bytes that several nodes use at the same time: a directory or a bucket.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/queue/artifact_store.h"
#include "server/queue/asset_store.h"

namespace storage::objects {

/// Objects are named by the sha256 of their bytes (64 hex digits, a precondition of every function). Thread-safe.
/// Throws queue::StoreFailure; then nothing was stored or removed.
class ObjectStore {
 public:
  virtual ~ObjectStore() = default;

  /// Stores an object, also in place of one with other bytes. It is durable and visible to all nodes when this returns,
  /// and never in part.
  virtual void put(const std::string& sha256, std::uint64_t bytes, const queue::AssetStore::Read& read) = 0;

  /// Null where there is none. Its bytes are not compared with the name. The reader of an object of up to small_bytes
  /// outlives its removal; that of a larger one may fail then.
  virtual std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256) = 0;
  virtual void remove(const std::string& sha256) = 0;  ///< no effect where there is none

  struct Object {
    std::string sha256;
    std::uint64_t bytes = 0;
  };
  /// Up to about 1,000 objects after the name `after`, in the order of names; none at the end.
  virtual std::vector<Object> list(const std::string& after) = 0;

  /// Deletes the traces of puts that have not ended within a day, because their node was killed.
  virtual void remove_unfinished() = 0;

  /// A URL from which anybody can read the object for an hour, as a file of this type; none where there are no URLs.
  [[nodiscard]] virtual std::optional<std::string> url_of(const std::string& /*sha256*/,
                                                          const std::string& /*media_type*/) const {
    return std::nullopt;
  }
};

constexpr std::size_t small_bytes = 256u << 10;  ///< most images of a page of thumbnails

/// Objects as files DIRECTORY/ab/abcdef... (durable_file.h) of a directory that several nodes mount. Creates the
/// directories where missing. Needs no locks: files appear whole by a rename, which replaces a file of other bytes. An
/// I/O error is a failure of kind `unavailable`: a file system over a network has them while its server is away, and a
/// put starts with a new file.
std::unique_ptr<ObjectStore> objects_in_directory(std::string directory);

}  // namespace storage::objects
