#pragma once
/// Objects as files DIRECTORY/ab/abcdef... (durable_file.h) of a directory that several nodes mount.

#include <memory>
#include <string>

#include "server/storage/objects/object_store.h"

namespace storage::objects {

/// Creates the directories where missing. Needs no locks: files appear whole by a rename, which replaces a file of
/// other bytes. An I/O error is a failure of kind `unavailable`: a file system over a network has them while its server
/// is away, and a put starts with a new file.
std::unique_ptr<ObjectStore> objects_in_directory(std::string directory);

}  // namespace storage::objects
