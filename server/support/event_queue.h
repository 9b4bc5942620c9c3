#pragma once
/// A queue of events from any thread to the one thread that runs an event loop.

#include <sys/eventfd.h>

#include <cerrno>
#include <mutex>
#include <system_error>
#include <utility>
#include <vector>

#include "server/support/descriptor.h"
#include "server/support/locked.h"

namespace support {

template <class Event>
class EventQueue {
 public:
  /// Throws std::system_error if the kernel provides no eventfd.
  EventQueue() : eventfd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (!eventfd_) throw std::system_error(errno, std::generic_category(), "eventfd");
  }

  /// Any thread.
  void post(Event event) {
    locked(mutex_, [&] { events_.push_back(std::move(event)); });
    interrupt();
  }
  /// Wakes the loop without an event. Any thread. Writing fails only if the counter is full; then the loop wakes
  /// anyway.
  void interrupt() { ::eventfd_write(eventfd_.get(), 1); }

  /// The loop polls this descriptor for POLLIN and then takes all events, in order.
  [[nodiscard]] int descriptor() const { return eventfd_.get(); }
  std::vector<Event> take() {
    eventfd_t count = 0;
    ::eventfd_read(eventfd_.get(), &count);
    return locked(mutex_, [&] { return std::exchange(events_, {}); });
  }

 private:
  Descriptor eventfd_;
  std::mutex mutex_;
  std::vector<Event> events_;
};

}  // namespace support
