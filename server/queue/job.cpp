#include "server/queue/job.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace queue {
namespace {

constexpr std::array<const char*, all_job_states.size()> state_names = {"queued", "running", "succeeded", "failed",
                                                                        "cancelled"};
constexpr std::array<const char*, all_job_kinds.size()> kind_names = {"render", "measure"};

template <class Values>
std::optional<typename Values::value_type> find_named(const Values& values, const std::string& name) {
  const auto found = std::ranges::find_if(values, [&](auto value) { return name == name_of(value); });
  if (found == values.end()) return std::nullopt;
  return *found;
}

}  // namespace

const char* name_of(JobState state) { return state_names[static_cast<std::size_t>(state)]; }
const char* name_of(JobKind kind) { return kind_names[static_cast<std::size_t>(kind)]; }
std::optional<JobState> job_state(const std::string& name) { return find_named(all_job_states, name); }
std::optional<JobKind> job_kind(const std::string& name) { return find_named(all_job_kinds, name); }

void end(Job& job, JobState state, std::int64_t now) {
  assert(may_move(job.state, state) && ended(state));
  job.state = state;
  job.ended_at = now;
  job.not_before.reset();
  job.cancel_requested = false;
  if (!job.expires_at && job.expires_in_s) job.expires_at = now + *job.expires_in_s * 1000;
}

JobSummary summary_of(const Job& job) {
  return {job.id, job.kind, job.name, job.batch, job.owner, job.keep, job.state};
}

Problem deadline_exceeded() { return {"deadline_exceeded", "The job had not ended by its deadline.", {}}; }

}  // namespace queue
