#pragma once
/// Objects as files DIRECTORY/ab/abcdef... (durable_file.h) of a directory that several nodes mount.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/storage/objects/object_store.h"

namespace storage::objects {

/// Needs no locks: files appear whole by a rename, which replaces a file of other bytes. An I/O error is a failure
/// of kind `unavailable`: a file system over a network has them while its server is away, and a put starts with a new
/// file.
class DirectoryObjects final : public ObjectStore {
 public:
  /// Creates the directories where missing.
  explicit DirectoryObjects(std::string directory);

  void put(const std::string& sha256, std::uint64_t bytes, const queue::AssetStore::Read& read) override;
  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256) override;
  void remove(const std::string& sha256) override;
  std::vector<Object> list(const std::string& after) override;
  void remove_unfinished() override;

 private:
  void store(const std::string& sha256, const queue::AssetStore::Read& read);

  const std::string directory_;
};

}  // namespace storage::objects
