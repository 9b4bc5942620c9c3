#include "server/storage/files/disk_space_monitor.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "server/storage/files/durable_file.h"

namespace queue {
namespace {

constexpr std::uint64_t reserve_part = 10, ballast_part = 32;

}  // namespace

DiskSpaceMonitor::DiskSpaceMonitor(const std::string& directory, const DiskRoomSettings& settings, Log log)
    : directory_(directory), ballast_(directory + "/ballast"), settings_(settings), log_(std::move(log)) {
  if (mkdir(directory.c_str(), 0750) < 0 && errno != EEXIST) files::fail("cannot create", directory);
  look();
}

bool DiskSpaceMonitor::look() {
  struct statvfs disk {};
  if (statvfs(directory_.c_str(), &disk) < 0) files::fail("cannot look at", directory_);
  const std::uint64_t size = disk.f_blocks * disk.f_frsize, free = disk.f_bavail * disk.f_frsize;
  const std::uint64_t ballast = std::min(settings_.ballast_bytes, size / ballast_part);
  bool has = has_ballast();
  if (has && free < ballast / 4) {
    unlink(ballast_.c_str());
    has = false;
    log_(LogLevel::error, "disk_full", {{"free_bytes", std::to_string(free)}});
  } else if (!has && free >= 2 * ballast) {
    has = take_ballast(ballast);
  }

  const std::lock_guard lock(mutex_);
  const DiskSpace::State before = room_.state;
  room_.free_bytes = free;
  room_.reserve_bytes = std::min(settings_.reserve_bytes, size / reserve_part);
  const bool scarce = free < room_.reserve_bytes;
  room_.state = !has ? DiskSpace::State::none : scarce ? DiskSpace::State::scarce : DiskSpace::State::enough;
  return before == DiskSpace::State::none && room_.state != DiskSpace::State::none;
}

DiskSpace DiskSpaceMonitor::now() const {
  const std::lock_guard lock(mutex_);
  return room_;
}

bool DiskSpaceMonitor::has_ballast() const { return access(ballast_.c_str(), F_OK) == 0; }

/// Whole or not at all. Not synced: one that a power cut halves is as good a ballast as its size.
bool DiskSpaceMonitor::take_ballast(std::uint64_t bytes) {
  const files::File file(ballast_, O_WRONLY | O_CREAT | O_EXCL);
  if (file.fd() >= 0 && posix_fallocate(file.fd(), 0, static_cast<off_t>(bytes)) == 0) return true;
  unlink(ballast_.c_str());
  return false;
}

}  // namespace queue
