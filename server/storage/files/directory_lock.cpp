#include "server/storage/files/directory_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <thread>

#include "server/queue/job_store.h"
#include "server/storage/files/durable_file.h"

namespace storage::files {
namespace {

std::string holder(int fd) {
  std::array<char, 32> text{};
  const ssize_t size = pread(fd, text.data(), text.size(), 0);
  return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "unknown";
}

/// A daemon that was killed while it started a worker leaves the lock to the forked process until that executes. On a
/// busy machine this takes a moment.
bool lock_soon(int fd, const std::function<void()>& wait) {
  for (int retries = DirectoryLock::retries; flock(fd, LOCK_EX | LOCK_NB) < 0; --retries) {
    if (errno != EWOULDBLOCK || retries == 0) return false;
    wait();
  }
  return true;
}

}  // namespace

void DirectoryLock::pause() { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }

DirectoryLock::DirectoryLock(const std::string& directory, const std::function<void()>& wait) {
  if (mkdir(directory.c_str(), 0750) < 0 && errno != EEXIST) fail("cannot create", directory);
  const std::string path = directory + "/lock";
  file_ = support::Descriptor(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640));
  if (!file_) fail("cannot open", path);
  if (!lock_soon(file_.get(), wait)) {
    if (errno != EWOULDBLOCK) fail("cannot lock", path);
    throw queue::StoreFailure("the data directory " + directory + " is in use by process " + holder(file_.get()));
  }
  // Only for error messages; a missing one reads "unknown".
  const std::string process = std::to_string(getpid());
  if (ftruncate(file_.get(), 0) == 0) [[maybe_unused]]
    const ssize_t written = pwrite(file_.get(), process.data(), process.size(), 0);
}

}  // namespace storage::files
