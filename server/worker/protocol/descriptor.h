#pragma once
/// A file descriptor with an owner, and the sealed memory in which large things are handed between processes.

#include <unistd.h>

#include <string_view>
#include <utility>

namespace worker {

/// Closes it when it goes. -1: none.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() { reset(); }
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this != &other) {
      reset();
      fd_ = std::exchange(other.fd_, -1);
    }
    return *this;
  }

  [[nodiscard]] int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }
  void reset() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }

 private:
  int fd_ = -1;
};

/// Memory of no process with these bytes, which nobody can change any more. Throws std::system_error.
Descriptor sealed_memory(std::string_view bytes);

/// Is it such memory? Only then can another process neither change, shrink nor block what we read from it.
bool is_sealed(int fd);

}  // namespace worker
