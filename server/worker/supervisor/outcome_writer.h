#pragma once
/// Writes the outcome of jobs that ran to the queue, on the threads of the store.

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "server/queue/queue.h"
#include "server/support/event_queue.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/supervisor/store_executor.h"

namespace worker {

using LoopEvents = support::EventQueue<std::function<void()>>;

/// Used by the thread of the event loop; callbacks run there, too. An outcome with an old fence changes nothing.
class OutcomeWriter {
 public:
  OutcomeWriter(queue::Queue& queue, StoreExecutor& executor, LoopEvents& events, int store_tries, queue::Log log)
      : queue_(queue), executor_(executor), events_(events), store_tries_(store_tries), log_(std::move(log)) {}

  /// Calls `on_failure` if the result cannot be stored.
  void succeed(Finished finished, std::function<void(const queue::Problem&)> on_failure);
  void fail(const std::string& id, std::int64_t fence, const queue::Problem& problem);
  void cancel(const std::string& id, std::int64_t fence);
  /// The job returns to the queue. `counts`: the attempt counts as a failure.
  void release(const std::string& id, std::int64_t fence, bool counts, bool suspect, std::chrono::milliseconds pause,
               std::function<void()> on_released);

  [[nodiscard]] std::size_t pending() const { return pending_; }

 private:
  void run(
      std::function<void()> task, std::function<void()> on_done = [] {});
  /// `moved` is false if the job had already ended, for example by a cancel that was reported before.
  void log_outcome(const char* event, const std::string& id, bool moved, queue::LogFields fields = {});

  queue::Queue& queue_;
  StoreExecutor& executor_;
  LoopEvents& events_;
  const int store_tries_;
  const queue::Log log_;
  std::size_t pending_ = 0;
};

}  // namespace worker
