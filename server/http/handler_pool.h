#pragma once
/// The few threads that handle requests, each with its own router, behind a bounded queue.

#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "server/http/router.h"
#include "server/queue/idle_threads.h"

namespace http {

class HandlerPool {
 public:
  /// Must not throw.
  using Task = std::function<void(Router&)>;

  /// `waiting_max` bounds what `submit` lets wait.
  HandlerPool(std::size_t threads, std::size_t waiting_max, const std::vector<Route>& routes,
              const telemetry::Log& log);
  ~HandlerPool();  ///< finishes what waits

  /// False, at once, when the queue is full. `heavy` tasks (large bodies, which take a second to read and parse) never
  /// hold all threads: half of them stay for short requests, unless there is only one.
  bool submit(Task task, bool heavy);

  /// For requests that were let in before and waited without a thread: never refused, and first in line.
  void resume(Task task);

 private:
  void run(const std::vector<Route>& routes, const telemetry::Log& log);

  const std::size_t heavy_max_, waiting_max_;
  std::mutex mutex_;
  queue::IdleThreads idle_;
  std::deque<Task> light_, heavy_;
  std::size_t heavy_running_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace http
