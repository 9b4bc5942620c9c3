#pragma once
/// Calls of the queue on threads of their own, so that the event loop never waits for a disk.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "server/queue/event_log.h"
#include "server/queue/job_store.h"
#include "server/queue/queue.h"
#include "server/support/event_queue.h"
#include "server/support/thread_pool.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/supervisor/result_backlog.h"

namespace worker {

/// Threads that call the store of the queue and retry failed calls. At the end the remaining tasks are run.
class StoreExecutor {
 public:
  StoreExecutor(int threads, std::chrono::milliseconds pause, queue::Log log)
      : pause_(pause), log_(std::move(log)), pool_(static_cast<std::size_t>(threads)) {}

  /// Any thread. `task` must not throw.
  void run(std::function<void()> task) { pool_.add(std::move(task)); }

  /// Within a task: repeats `call` while it throws, up to `tries` times (0: without limit) with a pause between. None
  /// on success, else the last failure. There is no retry after `stop_retrying` and on a broken disk.
  std::optional<queue::StoreFailure> run_with_retry(int tries, std::string_view operation,
                                                    const std::function<void()>& call);

  /// Ends all pauses and retries. Any thread.
  void stop_retrying();

 private:
  bool pause();  ///< false after stop_retrying

  const std::chrono::milliseconds pause_;
  const queue::Log log_;
  std::mutex mutex_;
  std::condition_variable retrying_stopped_;
  bool retrying_ = true;
  support::ThreadPool pool_;  ///< last: its threads use the other members
};

using LoopEvents = support::EventQueue<std::function<void()>>;

/// Writes the outcome of jobs that ran to the queue. Used by the thread of the event loop; callbacks run there, too. An
/// outcome with an old fence changes nothing.
class OutcomeWriter {
 public:
  OutcomeWriter(queue::Queue& queue, StoreExecutor& executor, LoopEvents& events, const SupervisorSettings& settings,
                const queue::Log& log);

  /// Calls `on_failure` if the result cannot be stored. Without a limit of tries it waits in the backlog.
  void succeed(Finished finished, std::function<void(const queue::Problem&)> on_failure);
  void fail(const std::string& id, std::int64_t fence, const queue::Problem& problem);
  void cancel(const std::string& id, std::int64_t fence);
  /// Keeps the last preview of a job whose end is being written.
  void keep_preview(const std::string& id, std::int64_t fence, std::string png);
  /// The job returns to the queue.
  void release(const std::string& id, std::int64_t fence, const queue::Release& release,
               std::function<void()> on_released);

  [[nodiscard]] std::size_t pending() const { return pending_; }
  [[nodiscard]] ResultBacklog& backlog() { return backlog_; }
  [[nodiscard]] const ResultBacklog& backlog() const { return backlog_; }

 private:
  void run(
      std::function<void()> task, std::function<void()> on_done = [] {});
  void store(const Finished& finished);
  /// `moved` is false if the job had already ended, for example by a cancel that was reported before.
  void log_outcome(const char* event, const std::string& id, bool moved, queue::LogFields fields = {});

  queue::Queue& queue_;
  StoreExecutor& executor_;
  LoopEvents& events_;
  const int store_tries_;
  const queue::Log log_;
  std::size_t pending_ = 0;
  ResultBacklog backlog_;  ///< last: its thread uses the other members
};

}  // namespace worker
