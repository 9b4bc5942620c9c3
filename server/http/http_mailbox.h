#pragma once
/// How handler threads and wakers speak to the gate's loop. Outlives the gate in the hands of whoever may still wake
/// it.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/http/pending_request.h"

namespace http {

/// A request on its way: used by the loop or by one handler thread, never by both at once.
struct PendingRequest {
  std::uint64_t client = 0;  ///< the connection's number, never used again
  Request request;
  std::chrono::steady_clock::time_point started;  ///< when the request was complete
  DeferredReply parked;                           ///< while it waits
};

struct Finished {
  std::shared_ptr<PendingRequest> exchange;
  std::string text;  ///< head and body
  std::optional<BodySource> source;
  std::shared_ptr<BodyStream> stream;
  bool keep_alive = false;
};
struct Waiting {
  std::shared_ptr<PendingRequest> exchange;
  std::function<void()> stop_watching;
};
struct Wake {
  std::uint64_t client = 0;
  std::weak_ptr<PendingRequest> exchange;
};
struct Drain {};

using Message = std::variant<Finished, Waiting, Wake, Drain>;

class Mailbox {
 public:
  Mailbox();  ///< throws std::system_error when the kernel gives no eventfd
  Mailbox(const Mailbox&) = delete;
  ~Mailbox();

  void post(Message message);  ///< any thread
  void interrupt();            ///< makes the loop look up without a message

  [[nodiscard]] int fd() const { return fd_; }  ///< readable when there is something
  std::vector<Message> take();                  ///< the loop's: all messages in order

 private:
  int fd_;
  std::mutex mutex_;
  std::vector<Message> messages_;
};

}  // namespace http
