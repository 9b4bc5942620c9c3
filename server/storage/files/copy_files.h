#pragma once
/// Copies of files named by their sha256, from a directory that another process uses.

#include <string>

namespace storage::files {

/// Copies every file DIRECTORY/ab/abcdef... to the same path below `into`, with the time of its last change, except
/// those removed meanwhile. Not synced. Throws StoreFailure, also when the bytes of a file do not match its name.
void copy_files(const std::string& directory, const std::string& into);

/// Syncs the whole file system of `path`.
void sync_disk(const std::string& path);

}  // namespace storage::files
