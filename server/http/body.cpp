#include "server/http/body.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>

namespace http {
namespace {

/// A file without a name; the kernel deletes it with its descriptor, however the process ends.
int open_unlinked(const std::string& directory) {
  const int fd = ::open(directory.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (fd >= 0) return fd;
  std::string path = directory + "/body-XXXXXX";  // not every file system supports O_TMPFILE
  const int named = ::mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(path.c_str());
  return named;
}

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

Body& Body::operator=(Body&& other) noexcept {
  Body former(std::move(other));
  swap(former);
  return *this;
}

void Body::swap(Body& other) noexcept {
  std::swap(budget_, other.budget_);
  std::swap(memory_, other.memory_);
  std::swap(fd_, other.fd_);
  std::swap(size_, other.size_);
}

Body::~Body() { release(); }

void Body::release() {
  if (fd_ >= 0) {
    ::close(fd_);
    budget_->file_used -= size_;
  } else if (budget_ != nullptr) {
    budget_->memory_used -= size_;
  }
  fd_ = -1;
  size_ = 0;
  memory_ = {};
}

bool Body::append(std::string_view bytes) {
  if (fd_ < 0) {
    const bool fits = size_ + bytes.size() <= budget_->body_memory_bytes &&
                      budget_->memory_used + bytes.size() <= budget_->memory_bytes;
    if (fits) {
      memory_ += bytes;
      size_ += bytes.size();
      budget_->memory_used += bytes.size();
      return true;
    }
    if (!spool()) return false;
  }
  if (budget_->file_used + bytes.size() > budget_->file_bytes) return false;
  size_ += bytes.size();
  budget_->file_used += bytes.size();
  return write_all(fd_, bytes);
}

bool Body::spool() {
  fd_ = open_unlinked(budget_->directory);
  if (fd_ < 0) return false;
  budget_->memory_used -= size_;
  budget_->file_used += size_;
  return write_all(fd_, std::exchange(memory_, {}));
}

std::size_t Body::read(std::uint64_t offset, char* into, std::size_t size) const {
  if (offset >= size_) return 0;
  size = std::min<std::uint64_t>(size, size_ - offset);
  if (fd_ < 0) return memory_.copy(into, size, offset);
  for (std::size_t done = 0; done < size;) {
    const ssize_t count = ::pread(fd_, into + done, size - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw std::system_error(count < 0 ? errno : EIO, std::generic_category(), "spooled body");
    done += static_cast<std::size_t>(count);
  }
  return size;
}

std::string Body::take() {
  std::string bytes = std::exchange(memory_, {});
  if (fd_ >= 0) {
    bytes.resize(size_);
    read(0, bytes.data(), bytes.size());
  }
  release();
  return bytes;
}

}  // namespace http
