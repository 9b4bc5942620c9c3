#pragma once
/// Keeps a second daemon out of a data folder.

#include <string>

namespace jobs::sqlite {

/// Holds an exclusive lock (flock) on FOLDER/lock, which tells the holder's process id; the kernel drops it when the
/// process ends in whatever way.
class FolderLock {
 public:
  /// Creates the folder where missing. Throws StoreFailure; when another process holds the lock, it says which.
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace jobs::sqlite
