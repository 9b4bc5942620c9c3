#include "server/worker/blame.h"

namespace worker {
namespace {

Verdict judge_alone(const Casualty& job, const std::string& how, const std::string& code) {
  // One that was to be cancelled anyway is; giving it back does that.
  if (job.cancel_requested) return {Verdict::Action::give_back, {}};
  if (job.attempt < job.max_attempts) return {Verdict::Action::count_attempt, {}};
  return {Verdict::Action::fail,
          {code,
           "The worker process " + how + " while it ran this job and no other, in attempt " +
               std::to_string(job.attempt) + " of " + std::to_string(job.max_attempts) + ".",
           {}}};
}

}  // namespace

std::vector<Verdict> judge(const std::vector<Casualty>& casualties, const std::string& how, bool excused,
                           const std::string& code) {
  if (excused) return std::vector<Verdict>(casualties.size());
  if (casualties.size() == 1) return {judge_alone(casualties.front(), how, code)};
  return std::vector<Verdict>(casualties.size(), Verdict{Verdict::Action::give_back_suspect, {}});
}

}  // namespace worker
