#include "server/jobs/job.h"

#include <array>
#include <utility>

namespace jobs {
namespace {

constexpr std::array<std::pair<JobState, const char*>, 5> state_names = {{
    {JobState::queued, "queued"},
    {JobState::running, "running"},
    {JobState::succeeded, "succeeded"},
    {JobState::failed, "failed"},
    {JobState::cancelled, "cancelled"},
}};

}  // namespace

const char* name_of(JobState state) { return state_names[static_cast<std::size_t>(state)].second; }

std::optional<JobState> job_state(const std::string& name) {
  for (const auto& [state, state_name] : state_names) {
    if (name == state_name) return state;
  }
  return std::nullopt;
}

}  // namespace jobs
