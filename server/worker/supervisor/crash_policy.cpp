#include "server/worker/supervisor/crash_policy.h"

namespace worker {
namespace {

using Action = CrashDecision::Action;

CrashDecision decide_single(const InFlightJob& job, const std::string& reason, const std::string& code) {
  if (job.cancel_requested) return {Action::release, {}};  // which cancels it
  if (job.attempt < job.max_attempts) return {Action::count_attempt, {}};
  return {Action::fail,
          {code,
           "The worker process " + reason + " while it ran this job and no other, in attempt " +
               std::to_string(job.attempt) + " of " + std::to_string(job.max_attempts) + ".",
           {}}};
}

}  // namespace

std::vector<CrashDecision> decide(const std::vector<InFlightJob>& jobs, const std::string& reason,
                                  bool planned_shutdown, const std::string& code) {
  if (!planned_shutdown && jobs.size() == 1) return {decide_single(jobs.front(), reason, code)};
  const Action action = planned_shutdown ? Action::release : Action::release_as_suspect;
  return std::vector<CrashDecision>(jobs.size(), CrashDecision{action, {}});
}

}  // namespace worker
