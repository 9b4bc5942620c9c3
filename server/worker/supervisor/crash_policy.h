#pragma once
/// Who pays for a worker's death. A pure function, so the rule is in one place and tested as a table.

#include <cstdint>
#include <string>
#include <vector>

#include "server/queue/job.h"

namespace worker {

/// A job that was in the worker when it died.
struct InFlightJob {
  std::string job_id;
  std::int64_t fence = 0;
  int attempt = 1, max_attempts = 1;
  bool cancel_requested = false;
  bool answered = false;  ///< its end was told before: it may be the killer, but nothing is left to settle
};

struct CrashDecision {
  enum class Action {
    give_back,          ///< queued again, the attempt not counted
    give_back_suspect,  ///< the same, and it runs alone from now on
    count_attempt,      ///< queued again, the attempt gone; runs alone from now on
    fail,               ///< its last attempt: `problem` says how the worker died
  };
  Action action = Action::give_back;
  queue::Problem problem;
};

/// `how` is the rest of a sentence that begins "The worker process": "was killed by signal 11 (SIGSEGV)".
/// `code` is the problem's. `excused`: we ended the worker for a reason that no job is to blame for.
std::vector<CrashDecision> decide(const std::vector<InFlightJob>& casualties, const std::string& how,
                                  bool planned_shutdown, const std::string& code = "worker_crashed");

}  // namespace worker
