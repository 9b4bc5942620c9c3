#pragma once
/// Decides which failures are followed by another attempt, and which job loses an attempt when the worker ends. Pure
/// functions, tested as tables.

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

#include "server/queue/job.h"

namespace worker {

struct CrashDecision {
  enum class Action {
    release,             ///< queued again, the attempt not counted
    release_as_suspect,  ///< the same, and it runs alone from now on
    count_attempt,       ///< queued again, the attempt counted; runs alone from now on
    fail,                ///< the last attempt; `problem` contains the reason
  };
  Action action = Action::release;
  queue::Problem problem;
};

/// About a job that was in the worker when it ended, one of `jobs`. `reason` is the end of a sentence that begins "The
/// worker process": "was killed by signal 11 (SIGSEGV)". `code` is that of the problem. `planned_shutdown`: no job is
/// the cause.
CrashDecision decide(const queue::Job& job, std::size_t jobs, const std::string& reason, bool planned_shutdown,
                     const std::string& code = "worker_crashed");

struct RetrySettings {
  /// Before the second attempt, and four times as long before each further one: a lack of memory or time rarely ends
  /// at once.
  std::chrono::milliseconds pause{1'000};
  std::chrono::milliseconds pause_max{60'000};
};

/// The pause before the attempt that follows a failure with `code`. None after the last attempt and for failures that
/// the job itself causes ("bad_scene", "bad_asset", "deadline_exceeded"). Transient are "out_of_memory", "timed_out",
/// "worker_crashed", "storage_failure" and "internal".
std::optional<std::chrono::milliseconds> retry_pause(const std::string& code, int attempt, int max_attempts,
                                                     const RetrySettings& settings);

}  // namespace worker
