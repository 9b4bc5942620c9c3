#include "server/worker/supervisor/failure_policy.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace worker {
namespace {

using Action = CrashDecision::Action;

constexpr std::array<std::string_view, 5> transient_codes{"out_of_memory", "timed_out", "worker_crashed",
                                                          "storage_failure", "internal"};

}  // namespace

CrashDecision decide(const queue::Job& job, std::size_t jobs, const std::string& reason, bool planned_shutdown,
                     const std::string& code) {
  if (planned_shutdown) return {Action::release, {}};
  if (jobs > 1) return {Action::release_as_suspect, {}};
  if (job.cancel_requested) return {Action::release, {}};  // which cancels it
  if (job.attempt < job.max_attempts) return {Action::count_attempt, {}};
  return {Action::fail,
          {code,
           "The worker process " + reason + " while it ran this job and no other, in attempt " +
               std::to_string(job.attempt) + " of " + std::to_string(job.max_attempts) + ".",
           {}}};
}

std::optional<std::chrono::milliseconds> retry_pause(const std::string& code, int attempt, int max_attempts,
                                                     const RetrySettings& settings) {
  const bool transient = std::ranges::find(transient_codes, code) != transient_codes.end();
  if (!transient || attempt >= max_attempts) return std::nullopt;
  std::chrono::milliseconds pause = settings.pause;
  for (int i = 1; i < attempt && pause < settings.pause_max; ++i) pause *= 4;
  return std::min(pause, settings.pause_max);
}

}  // namespace worker
