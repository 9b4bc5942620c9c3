#pragma once
/// Threads that run handlers, behind a bounded queue.

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace http {

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

}  // namespace http
