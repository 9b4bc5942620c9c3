#include "server/worker/supervisor/crash_policy.h"

namespace worker {
namespace {

CrashDecision judge_alone(const InFlightJob& job, const std::string& how, const std::string& code) {
  // One that was to be cancelled anyway is; giving it back does that.
  if (job.cancel_requested) return {CrashDecision::Action::give_back, {}};
  if (job.attempt < job.max_attempts) return {CrashDecision::Action::count_attempt, {}};
  return {CrashDecision::Action::fail,
          {code,
           "The worker process " + how + " while it ran this job and no other, in attempt " +
               std::to_string(job.attempt) + " of " + std::to_string(job.max_attempts) + ".",
           {}}};
}

}  // namespace

std::vector<CrashDecision> decide(const std::vector<InFlightJob>& casualties, const std::string& how,
                                  bool planned_shutdown, const std::string& code) {
  if (planned_shutdown) return std::vector<CrashDecision>(casualties.size());
  if (casualties.size() == 1) return {judge_alone(casualties.front(), how, code)};
  return std::vector<CrashDecision>(casualties.size(), CrashDecision{CrashDecision::Action::give_back_suspect, {}});
}

}  // namespace worker
