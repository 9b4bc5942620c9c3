#include "server/queue/job.h"

#include <array>
#include <cassert>
#include <utility>

namespace queue {
namespace {

constexpr std::array<std::pair<JobState, const char*>, 5> state_names = {{
    {JobState::queued, "queued"},
    {JobState::running, "running"},
    {JobState::succeeded, "succeeded"},
    {JobState::failed, "failed"},
    {JobState::cancelled, "cancelled"},
}};
constexpr std::array<const char*, all_job_kinds.size()> kind_names = {"render", "measure"};

}  // namespace

const char* name_of(JobState state) { return state_names[static_cast<std::size_t>(state)].second; }

std::optional<JobState> job_state(const std::string& name) {
  for (const auto& [state, state_name] : state_names) {
    if (name == state_name) return state;
  }
  return std::nullopt;
}

const char* name_of(JobKind kind) { return kind_names[static_cast<std::size_t>(kind)]; }

std::optional<JobKind> job_kind(const std::string& name) {
  for (const JobKind kind : all_job_kinds) {
    if (name == name_of(kind)) return kind;
  }
  return std::nullopt;
}

void end(Job& job, JobState state, std::int64_t now) {
  assert(may_move(job.state, state) && ended(state));
  job.state = state;
  job.ended_at = now;
  job.not_before.reset();
  job.cancel_requested = false;
  if (!job.expires_at && job.expires_in_s) job.expires_at = now + *job.expires_in_s * 1000;
}

Problem deadline_exceeded() { return {"deadline_exceeded", "The job had not ended by its deadline.", {}}; }

}  // namespace queue
