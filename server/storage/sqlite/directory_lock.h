#pragma once
/// Keeps a second daemon out of a data directory.

#include <chrono>
#include <string>

namespace storage::sqlite {

/// Holds an exclusive lock (flock) on DIRECTORY/lock, which tells the holder's process id; the kernel drops it when the
/// process ends in whatever way.
class DirectoryLock {
 public:
  /// How long a lock that another process holds is waited for: after a daemon was killed it may take a moment to go.
  static constexpr std::chrono::seconds patience{3};

  /// Creates the directory where missing. Throws StoreFailure; when another process holds the lock, it says which.
  explicit DirectoryLock(const std::string& directory);
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace storage::sqlite
