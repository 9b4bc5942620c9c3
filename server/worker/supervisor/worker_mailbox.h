#pragma once
/// Calls from any thread, run by the one thread that owns the state they touch.

#include <functional>
#include <mutex>
#include <vector>

#include "server/worker/protocol/descriptor.h"

namespace worker {

class Mailbox {
 public:
  Mailbox();  ///< throws std::system_error

  /// Any thread.
  void post(std::function<void()> call);
  void wake();

  /// The owner: polls this for POLLIN, then runs what was posted, in order.
  [[nodiscard]] int descriptor() const { return event_.get(); }
  void run_posted();

 private:
  Descriptor event_;
  std::mutex mutex_;
  std::vector<std::function<void()>> posted_;
};

}  // namespace worker
