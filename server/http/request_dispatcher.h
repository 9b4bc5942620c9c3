#pragma once
/// Routes requests, runs their handlers on a pool of threads and posts the replies to the event loop; logs and counts
/// every request.

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/http/connection.h"
#include "server/telemetry/json_log.h"

namespace http {

/// Threads that run handlers, behind a bounded queue.
class HandlerPool {
 public:
  /// Must not throw.
  using Task = std::function<void()>;

  /// `waiting_max` is the length of the queue.
  HandlerPool(std::size_t threads, std::size_t waiting_max);
  ~HandlerPool();  ///< finishes the queued tasks

  /// Returns false at once if the queue is full. Requests with a large body take up to a second to parse. They use at
  /// most half of the threads (at least one), so that short requests do not wait for them.
  bool submit(Task task, bool large_body);

  /// Queues a task of a request that was accepted before: never refused, and first in line.
  void resume(Task task);

 private:
  void run();

  const std::size_t large_max_, waiting_max_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Task> small_, large_;
  std::size_t large_running_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

/// The public functions are for the event loop's thread, except begin_drain().
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

  void on_deferred(Client& client, std::function<void()> stop_watching);
  void start_reply(Client& client, ReplyReady& ready, Time now);
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
  HandlerPool pool_;  // last: its threads use the other members
};

}  // namespace http
