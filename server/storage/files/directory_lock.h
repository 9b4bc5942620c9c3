#pragma once
/// The lock of a data directory.

#include <chrono>
#include <string>

namespace storage::files {

/// Prevents a second daemon on a data directory: an exclusive lock (flock) on DIRECTORY/lock, a file with the process
/// id of the holder. The kernel releases it when the process ends.
class DirectoryLock {
 public:
  /// Time to wait for a lock that another process holds: a killed daemon may need a moment to end.
  static constexpr std::chrono::seconds patience{3};

  /// Creates the directory where missing. Throws StoreFailure, with the process id of another holder.
  explicit DirectoryLock(const std::string& directory);
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace storage::files
