#pragma once
/// Copies of files named by their sha256, from a directory that another process goes on with.

#include <string>

namespace queue {

/// Every file DIRECTORY/ab/abcdef... to the same place below `into`, with the time of its last change; what is removed
/// meanwhile is left out. Not synced. Throws StoreFailure, also when the bytes of one are not those of its name.
void copy_files(const std::string& directory, const std::string& into);

/// Everything written so far to the file system that holds `path`.
void sync_disk(const std::string& path);

}  // namespace queue
