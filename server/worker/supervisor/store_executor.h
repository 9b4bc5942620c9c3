#pragma once
/// Threads that call the store of the queue, so that no other thread waits for a disk, and that retry failed calls.

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
#include "server/queue/job_store.h"

namespace worker {

class StoreExecutor {
 public:
  StoreExecutor(int threads, std::chrono::milliseconds pause, queue::Log log);
  /// Runs the remaining tasks, then ends.
  ~StoreExecutor();

  /// Any thread. `task` must not throw.
  void run(std::function<void()> task);

  /// Within a task: repeats `call` while it throws, up to `tries` times (0: without limit) with a pause between. None
  /// on success, else the last failure. There is no retry after `stop_retrying` and on a broken disk.
  std::optional<queue::StoreFailure> run_with_retry(int tries, std::string_view operation,
                                                    const std::function<void()>& call);

  /// Ends all pauses and retries. Any thread.
  void stop_retrying();

 private:
  void run_tasks();
  bool pause();  ///< false after stop_retrying

  const std::chrono::milliseconds pause_;
  const queue::Log log_;
  std::mutex mutex_;
  std::condition_variable task_available_, retrying_stopped_;
  std::deque<std::function<void()>> tasks_;
  bool stopping_ = false, retrying_ = true;
  std::vector<std::thread> threads_;
};

}  // namespace worker
