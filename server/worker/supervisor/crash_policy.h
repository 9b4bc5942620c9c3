#pragma once
/// Decides which job loses an attempt when the worker ends. A pure function, tested as a table.

#include <cstdint>
#include <string>
#include <vector>

#include "server/queue/job.h"

namespace worker {

/// A job that was in the worker when it ended.
struct InFlightJob {
  std::string job_id;
  std::int64_t fence = 0;
  int attempt = 1, max_attempts = 1;
  bool cancel_requested = false;
  bool reported = false;  ///< its end was reported before; it may be the cause, but needs no decision
};

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

/// One decision per job. `reason` is the end of a sentence that begins "The worker process": "was killed by signal 11
/// (SIGSEGV)". `code` is that of the problem. `planned_shutdown`: no job is the cause.
std::vector<CrashDecision> decide(const std::vector<InFlightJob>& jobs, const std::string& reason,
                                  bool planned_shutdown, const std::string& code = "worker_crashed");

}  // namespace worker
