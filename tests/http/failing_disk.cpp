/// failing_disk.so, for LD_PRELOAD: injects disk failures at steps that a test selects.
///
/// Steps are calls that change the disk, on files whose paths begin with $FAILING_DISK_PREFIX: writes, syncs, renames,
/// truncations, creations and deletions, counted from 1 over all threads. The test controls them with the file
/// $FAILING_DISK_CONTROL, mapped by both sides: struct Control, little-endian.

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

namespace {

struct Control {
  std::atomic<std::int64_t> steps;   ///< executed so far
  std::atomic<std::int64_t> first;   ///< first step that fails; 0: none
  std::atomic<std::int64_t> last;    ///< last step that fails
  std::atomic<std::int64_t> error;   ///< errno of the failures
  std::atomic<std::int64_t> failed;  ///< number of failed steps
};

const std::string& prefix() {
  static const std::string value = [] {
    const char* path = std::getenv("FAILING_DISK_PREFIX");
    return path == nullptr ? std::string() : std::string(path);
  }();
  return value;
}

/// Null without a control file; then nothing fails.
Control* control() {
  static Control* const value = [] {
    const char* path = std::getenv("FAILING_DISK_CONTROL");
    const int fd = path == nullptr ? -1 : ::open(path, O_RDWR | O_CLOEXEC);
    if (fd < 0) return static_cast<Control*>(nullptr);
    void* mapped = mmap(nullptr, sizeof(Control), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    ::close(fd);
    return mapped == MAP_FAILED ? nullptr : static_cast<Control*>(mapped);
  }();
  return value;
}

bool is_meant(const char* path) { return !prefix().empty() && std::string_view(path).starts_with(prefix()); }

bool is_meant(int fd) {
  if (prefix().empty()) return false;
  std::array<char, 64> link{};
  std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", fd);
  std::array<char, 4096> path{};
  const ssize_t size = readlink(link.data(), path.data(), path.size() - 1);
  return size > 0 && is_meant(path.data());
}

/// Counts a step; returns true and sets errno if it must fail.
template <class File>
bool fails(const File& file) {
  if (control() == nullptr || !is_meant(file)) return false;
  const std::int64_t step = ++control()->steps;
  const std::int64_t first = control()->first;
  if (first == 0 || step < first || step > control()->last) return false;
  ++control()->failed;
  errno = static_cast<int>(control()->error);
  return true;
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

// Names and signatures of libc; programs with large files call the 64-bit ones, which are the same functions.
extern "C" {

ssize_t write(int fd, const void* bytes, size_t size) {
  static const auto real = next<ssize_t (*)(int, const void*, size_t)>("write");
  return fails(fd) ? -1 : real(fd, bytes, size);
}
ssize_t pwrite(int fd, const void* bytes, size_t size, off_t offset) {
  static const auto real = next<ssize_t (*)(int, const void*, size_t, off_t)>("pwrite");
  return fails(fd) ? -1 : real(fd, bytes, size, offset);
}
int fsync(int fd) {
  static const auto real = next<int (*)(int)>("fsync");
  return fails(fd) ? -1 : real(fd);
}
int fdatasync(int fd) {
  static const auto real = next<int (*)(int)>("fdatasync");
  return fails(fd) ? -1 : real(fd);
}
int ftruncate(int fd, off_t size) noexcept {
  static const auto real = next<int (*)(int, off_t)>("ftruncate");
  return fails(fd) ? -1 : real(fd, size);
}
int rename(const char* from, const char* to) noexcept {
  static const auto real = next<int (*)(const char*, const char*)>("rename");
  return fails(to) ? -1 : real(from, to);
}
int unlink(const char* path) noexcept {
  static const auto real = next<int (*)(const char*)>("unlink");
  return fails(path) ? -1 : real(path);
}
int open(const char* path, int flags, ...) {
  static const auto real = next<int (*)(const char*, int, ...)>("open");
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = va_arg(rest, mode_t);  // meaningless, and unused, without O_CREAT
  va_end(rest);
  return (flags & O_CREAT) != 0 && fails(path) ? -1 : real(path, flags, mode);
}
static_assert(sizeof(off_t) == sizeof(off64_t));
ssize_t pwrite64(int, const void*, size_t, off64_t) __attribute__((alias("pwrite")));
int ftruncate64(int, off64_t) noexcept __attribute__((alias("ftruncate")));
int open64(const char*, int, ...) __attribute__((alias("open")));
}
