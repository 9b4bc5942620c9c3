#pragma once
/// Callers that wait for the end of a job or for a preview of it.

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/queue/job_runner.h"
#include "server/queue/job_store.h"
#include "server/queue/previews.h"

namespace queue {

/// Thread-safe.
class JobWaiters {
 public:
  JobWaiters(JobStore& jobs, AttachedRunner& runner, Clock clock)
      : jobs_(jobs), runner_(runner), previews_(std::move(clock)) {}

  /// Calls `done` once, from any thread, when the job has ended (at once, from this thread, if it has or does not
  /// exist). `done` must be quick and must not throw. Returns a token for `cancel`.
  std::uint64_t when_ended(const std::string& id, std::function<void()> done);
  void cancel(std::uint64_t token);

  /// The latest preview of a running job, at most `side` (<= preview_side_max) pixels wide and high.
  Previews::Latest preview(const std::string& id, std::uint32_t side) { return previews_.latest(id, side); }
  /// Requests a newer one. Calls `done` once, from any thread, when it is there or the job no longer runs, and never
  /// where it did not run. Otherwise as when_ended. Returns a token for `cancel_preview`.
  std::uint64_t request_preview(const std::string& id, std::uint32_t side, std::function<void()> done);
  void cancel_preview(std::uint64_t token) { previews_.cancel(token); }

  // ---- for the runner and the life cycle of jobs
  void on_started(const std::string& id) { previews_.begin(id); }
  void add_preview(const std::string& id, std::uint32_t side, std::string png);  ///< ignored of jobs that do not run
  void on_stopped(const std::string& id);                                        ///< ended or released
  void on_ended(const std::string& id);

 private:
  struct Waiter {
    std::string id;
    std::function<void()> done;
  };

  JobStore& jobs_;
  AttachedRunner& runner_;
  Previews previews_;
  std::mutex mutex_;                                            ///< never held over a call of the store or of a waiter
  std::map<std::uint64_t, Waiter> waiters_;                     ///< by token
  std::unordered_multimap<std::string, std::uint64_t> tokens_;  ///< by job id
  std::uint64_t last_token_ = 0;
};

}  // namespace queue
