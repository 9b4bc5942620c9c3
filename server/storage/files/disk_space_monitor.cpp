#include "server/storage/files/disk_space_monitor.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "server/storage/files/durable_file.h"

namespace storage::files {
namespace {

constexpr std::uint64_t reserve_part = 10, ballast_part = 32;

}  // namespace

DiskSpaceMonitor::DiskSpaceMonitor(const std::string& directory, const DiskSpaceSettings& settings, queue::Log log)
    : directory_(directory), ballast_(directory + "/ballast"), settings_(settings), log_(std::move(log)) {
  if (mkdir(directory.c_str(), 0750) < 0 && errno != EEXIST) fail("cannot create", directory);
  measure();
}

bool DiskSpaceMonitor::measure() {
  struct statvfs disk {};
  if (statvfs(directory_.c_str(), &disk) < 0) fail("cannot measure", directory_);
  const std::uint64_t size = disk.f_blocks * disk.f_frsize, free = disk.f_bavail * disk.f_frsize;
  const std::uint64_t ballast = std::min(settings_.ballast_bytes, size / ballast_part);
  bool has = access(ballast_.c_str(), F_OK) == 0;
  if (has && free < ballast / 4) {
    unlink(ballast_.c_str());
    has = false;
    log_(queue::LogLevel::error, "disk_full", {{"free_bytes", std::to_string(free)}});
  } else if (!has && free >= 2 * ballast) {
    has = create_ballast(ballast);
  }

  const std::lock_guard lock(mutex_);
  const queue::DiskSpace::State before = space_.state;
  space_.free_bytes = free;
  space_.reserve_bytes = std::min(settings_.reserve_bytes, size / reserve_part);
  const bool scarce = free < space_.reserve_bytes;
  space_.state = !has     ? queue::DiskSpace::State::none
                 : scarce ? queue::DiskSpace::State::scarce
                          : queue::DiskSpace::State::enough;
  return before == queue::DiskSpace::State::none && space_.state != queue::DiskSpace::State::none;
}

queue::DiskSpace DiskSpaceMonitor::now() const {
  const std::lock_guard lock(mutex_);
  return space_;
}

/// Whole or not at all. Not synced: after power loss a shorter one still frees its size.
bool DiskSpaceMonitor::create_ballast(std::uint64_t bytes) {
  const support::Descriptor file(::open(ballast_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640));
  if (file && posix_fallocate(file.get(), 0, static_cast<off_t>(bytes)) == 0) return true;
  unlink(ballast_.c_str());
  return false;
}

}  // namespace storage::files
