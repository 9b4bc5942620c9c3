/// What owners change of jobs that are there, what the queue looks like, and keeping house in it.

#include <algorithm>
#include <utility>

#include "server/queue/pending_announcement.h"
#include "server/queue/queue.h"

namespace queue {
namespace {

constexpr int page_jobs = 1000;
constexpr int upkeep_step = 100;  // jobs of each kind: some milliseconds of the one writer

}  // namespace

RetryOutcome Queue::retry(const std::string& id) {
  const PendingAnnouncement arrival(*this, {id});
  const RetryOutcome outcome = store_.retry(id, clock_());
  if (outcome == RetryOutcome::queued) {
    const std::optional<Job> job = store_.find(id);
    notify_queued(id);
    wake_runner(job && job->suspect);
  }
  return outcome;
}

ChangeOutcome Queue::change(const std::string& id, const JobChange& change, std::optional<std::int64_t> revision) {
  const ChangeOutcome outcome = store_.change(id, change, revision);
  if (outcome == ChangeOutcome::changed && observer_ != nullptr) {
    const std::optional<Job> job = store_.find(id);
    if (job && !ended(job->state)) tell(id, job->state);  // no move, but news to who waits for any
  }
  return outcome;
}

QueueState Queue::state() {
  const std::int64_t now = clock_();
  QueueState state;
  state.depth = store_.depth();
  for (const JobState which : all_job_states) state.jobs[which] = store_.count(which);
  if (state.depth.oldest_at) {
    state.oldest_age_s = static_cast<double>(std::max<std::int64_t>(now - *state.depth.oldest_at, 0)) / 1000;
  }
  const std::lock_guard lock(live_mutex_);
  if (recent_ends_.size() >= 2) {
    const auto elapsed_ms = static_cast<double>(recent_ends_.back() - recent_ends_.front());
    const double each_ms = elapsed_ms / static_cast<double>(recent_ends_.size() - 1);
    const std::int64_t to_do = state.jobs[JobState::queued] - state.depth.delayed + state.jobs[JobState::running];
    state.eta_s = each_ms * static_cast<double>(to_do) / 1000;
  }
  return state;
}

std::optional<BatchState> Queue::find_batch(const std::string& id) { return store_.find_batch(id); }

void Queue::cancel_batch(const std::string& id) {
  const BatchCancel changed = store_.cancel_batch(id, clock_());
  for (const std::string& job : changed.cancelled) {
    tell_end(job, JobState::cancelled);
  }
  const std::shared_lock lock(runner_mutex_);
  if (runner_ == nullptr) return;
  for (const std::string& job : changed.cancelling) runner_->cancel(job);
}

int Queue::retry_batch(const std::string& id) {
  std::vector<std::string> without_success;
  JobFilter filter;
  filter.batch = id;
  for (const JobState state : {JobState::failed, JobState::cancelled}) {
    filter.state = state;
    std::string cursor;
    do {
      const JobPage page = store_.list(filter, cursor, page_jobs);
      for (const Job& job : page.items) without_success.push_back(job.id);
      cursor = page.next_cursor;
    } while (!cursor.empty());
  }
  const PendingAnnouncement arrival(*this, std::move(without_success));
  const BatchRetry retried = store_.retry_batch(id, clock_());
  for (const std::string& job : retried.jobs) notify_queued(job);
  if (!retried.jobs.empty()) wake_runner(retried.suspects);
  return static_cast<int>(retried.jobs.size());
}

/// After the end of a job that failed.
void Queue::stop_where_too_many_failed(const std::string& job_id) {
  const std::optional<Job> job = store_.find(job_id);
  if (!job || job->batch.empty()) return;
  const std::optional<BatchState> state = store_.find_batch(job->batch);
  if (!state || !state->batch.max_failed) return;
  const auto failed = state->jobs.find(JobState::failed);
  if (failed != state->jobs.end() && failed->second > *state->batch.max_failed) cancel_batch(job->batch);
}

// ---- for whoever keeps house

bool Queue::run_maintenance() {
  const MaintenanceResult upkeep = store_.run_maintenance(clock_(), settings_.expired_kept_ms, upkeep_step);
  for (const std::string& id : upkeep.abandoned) {
    {
      const std::lock_guard lock(live_mutex_);
      progress_.erase(id);
    }
    std::optional<PendingAnnouncement> arrival(std::in_place, *this, std::vector{id});
    notify_given_back(id, arrival);
  }
  for (const std::string& id : upkeep.overdue) {
    tell_end(id, JobState::failed);
  }
  for (const std::string& id : upkeep.overdue) stop_where_too_many_failed(id);
  for (const Artifact& artifact : upkeep.artifacts) pins_.collect(artifact.sha256);
  if (upkeep.due || !upkeep.abandoned.empty()) wake_runner(upkeep.suspects_due || !upkeep.abandoned.empty());
  return upkeep.more;
}

}  // namespace queue
