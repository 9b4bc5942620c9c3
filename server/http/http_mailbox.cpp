#include "server/http/http_mailbox.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace http {

Mailbox::Mailbox() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

Mailbox::~Mailbox() { ::close(fd_); }

void Mailbox::post(Message message) {
  {
    const std::lock_guard lock(mutex_);
    messages_.push_back(std::move(message));
  }
  interrupt();
}

void Mailbox::interrupt() {
  // Fails only when the counter is full: then the loop is about to look anyway.
  [[maybe_unused]] const int full = ::eventfd_write(fd_, 1);
}

std::vector<Message> Mailbox::take() {
  eventfd_t count = 0;
  [[maybe_unused]] const int empty = ::eventfd_read(fd_, &count);
  const std::lock_guard lock(mutex_);
  return std::exchange(messages_, {});
}

}  // namespace http
