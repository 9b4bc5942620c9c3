#pragma once
/// Routes requests, runs their handlers on a pool of threads and posts the replies to the event loop; logs and counts
/// every request.

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/http/connection.h"
#include "server/support/thread_pool.h"
#include "server/telemetry/json_log.h"

namespace http {

/// The public functions are for the event loop's thread, except begin_drain(). The destructor joins the threads.
class RequestDispatcher {
 public:
  /// `settings` must outlive it.
  RequestDispatcher(const HttpServerSettings& settings, std::vector<Route> routes,
                    std::function<std::string()> new_request_id, const telemetry::Log& log,
                    std::shared_ptr<ServerEvents> events);

  /// Replies of later requests close their connections. Any thread.
  void begin_drain() { draining_ = true; }

  /// Queues the complete request of the client for a handler, or answers it 503 if too many are queued.
  void dispatch(Client& client, Time now);
  /// Answers the request that the connection has refused.
  void refuse(Client& client, Time now);
  /// Queues a deferred reply for a handler thread.
  void resume(Client& client, bool timed_out);

  /// Queues DeferredReply::on_disconnected for a handler thread. Precondition: the watch has stopped.
  void abandon(const std::shared_ptr<PendingRequest>& pending);
  /// Answers a deferred reply with the problem.
  void refuse_deferred(Client& client, const Problem& problem, Time now);

  void on_deferred(Client& client, std::function<void()> stop_watching);
  void start_reply(Client& client, ReplyReady& ready, Time now);
  /// Queues the next part of the body for a thread, if the connection wants one.
  void read_body(Client& client, Time now);
  /// Returns false if nothing waits for the notification any more.
  bool on_notification(Client& client, const Notification& notification, Time now);

 private:
  Answer guarded(const Request& request, const std::function<Answer()>& call) const;
  void post_answer(const std::shared_ptr<PendingRequest>& pending, Answer answer);
  ReplyReady ready(const std::shared_ptr<PendingRequest>& pending, Reply reply) const;
  std::function<void()> notifier(const std::shared_ptr<PendingRequest>& pending) const;

  const HttpServerSettings& settings_;
  const std::vector<Route> routes_;
  const std::function<std::string()> new_request_id_;
  const telemetry::Log log_;
  const std::shared_ptr<ServerEvents> events_;
  std::atomic<bool> draining_ = false;
  support::ThreadPool pool_, bodies_;  // last: their threads use the other members
};

}  // namespace http
