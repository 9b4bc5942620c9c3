#pragma once
/// Keeps a second daemon out of a data folder.

#include <chrono>
#include <string>

namespace jobs::sqlite {

/// Holds an exclusive lock (flock) on FOLDER/lock, which tells the holder's process id; the kernel drops it when the
/// process ends in whatever way.
class FolderLock {
 public:
  /// How long a lock that another process holds is waited for: after a daemon was killed it may take a moment to go.
  static constexpr std::chrono::seconds patience{3};

  /// Creates the folder where missing. Throws StoreFailure; when another process holds the lock, it says which.
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace jobs::sqlite
