#pragma once
/// A few threads that talk to the queue's store, so that nobody else waits for a disk, and that repeat what the store
/// refused.

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "server/queue/event_log.h"
#include "server/queue/idle_threads.h"
#include "server/queue/job_store.h"

namespace worker {

class StoreExecutor {
 public:
  StoreExecutor(int threads, std::chrono::milliseconds pause, queue::Log log);
  /// Runs what was given, then ends.
  ~StoreExecutor();

  /// Any thread. `task` must not throw.
  void run(std::function<void()> task);

  /// From within a task: repeats `call` while it throws, up to `tries` times with a pause between (0: until it works).
  /// Null when it worked, else the last failure. After `give_up`, and on a disk that is broken, it is tried once.
  std::optional<queue::StoreFailure> run_with_retry(int tries, std::string_view what,
                                                    const std::function<void()>& call);

  /// Nothing waits or repeats any more. Any thread.
  void give_up();

 private:
  void work();
  bool wait_a_little();  ///< false after give_up

  std::chrono::milliseconds pause_;
  queue::Log log_;
  std::mutex mutex_;
  queue::IdleThreads idle_;
  std::condition_variable gave_up_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false;
  bool given_up_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace worker
