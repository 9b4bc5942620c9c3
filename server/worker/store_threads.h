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

#include "server/jobs/idle_threads.h"
#include "server/jobs/job_store.h"
#include "server/jobs/log.h"

namespace worker {

class StoreThreads {
 public:
  StoreThreads(int threads, std::chrono::milliseconds pause, jobs::Log log);
  /// Runs what was given, then ends.
  ~StoreThreads();

  /// Any thread. `task` must not throw.
  void run(std::function<void()> task);

  /// From within a task: repeats `call` while it throws, up to `tries` times with a pause between (0: until it works).
  /// Null when it worked, else the last failure. After `give_up`, and on a disk that is broken, it is tried once.
  std::optional<jobs::StoreFailure> persist(int tries, std::string_view what, const std::function<void()>& call);

  /// Nothing waits or repeats any more. Any thread.
  void give_up();

 private:
  void work();
  bool wait_a_little();  ///< false after give_up

  std::chrono::milliseconds pause_;
  jobs::Log log_;
  std::mutex mutex_;
  jobs::IdleThreads idle_;
  std::condition_variable gave_up_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false;
  bool given_up_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace worker
