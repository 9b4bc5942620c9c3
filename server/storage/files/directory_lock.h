#pragma once
/// The lock of a data directory.

#include <functional>
#include <string>

#include "server/support/descriptor.h"

namespace storage::files {

/// Prevents a second daemon on a data directory: an exclusive lock (flock) on DIRECTORY/lock, a file with the process
/// id of the holder. The kernel releases it when the process ends.
class DirectoryLock {
 public:
  /// A lock that another process holds is tried again for 3 s: a killed daemon may need a moment to end.
  static constexpr int retries = 300;
  static void pause();  ///< 10 ms

  /// Creates the directory where missing. Calls `wait` before each retry. Throws StoreFailure, with the process id of
  /// another holder.
  explicit DirectoryLock(const std::string& directory, const std::function<void()>& wait = pause);

 private:
  support::Descriptor file_;
};

}  // namespace storage::files
