#include <algorithm>
#include <utility>

#include "server/queue/queue.h"

namespace queue {
namespace {

constexpr std::int64_t position_max = 1000;  // counting walks an index

}  // namespace

std::optional<JobView> JobQueries::find(const std::string& id) {
  std::optional<Job> job = context_.stores.jobs.find(id);
  if (!job) return std::nullopt;
  const double fraction = job->state == JobState::succeeded ? 1 : progress(id);
  std::optional<std::int64_t> position;
  if (job->state == JobState::queued) {
    const std::optional<std::int64_t> before = context_.stores.statistics.queue_position(id, position_max);
    if (before && *before < position_max) position = *before + 1;
  }
  return JobView{*std::move(job), fraction, position};
}

JobPage JobQueries::list(const JobFilter& filter, const std::string& cursor, int limit) {
  return context_.stores.jobs.list(filter, cursor, std::max(limit, 1));
}

QueueState JobQueries::state() {
  QueueState state;
  state.depth = context_.stores.statistics.depth();
  for (const JobState which : all_job_states) state.jobs[which] = context_.stores.statistics.count(which);
  if (state.depth.oldest_at) {
    state.oldest_age_s =
        static_cast<double>(std::max<std::int64_t>(context_.clock() - *state.depth.oldest_at, 0)) / 1000;
  }
  if (const auto interval_ms = context_.running.mean_interval_ms()) {
    const std::int64_t to_do = state.jobs[JobState::queued] - state.depth.delayed + state.jobs[JobState::running];
    state.eta_s = *interval_ms * static_cast<double>(to_do) / 1000;
  }
  return state;
}

std::string JobQueries::not_ready() {
  if (const DiskSpace space = context_.settings.disk_space(); space.state != DiskSpace::State::enough)
    return "disk: " + describe(space);
  try {
    context_.stores.maintenance.probe();
  } catch (const StoreFailure& failure) {
    return std::string("store: ") + failure.what();
  }
  std::string reason = "worker: not started";
  context_.runner.call([&](JobRunner& runner) { reason = runner.not_ready(); });
  return reason;
}

}  // namespace queue
