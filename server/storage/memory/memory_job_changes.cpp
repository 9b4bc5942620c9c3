/// What owners and the housekeeper change: retries, other fields, expiry.

#include <algorithm>
#include <cassert>
#include <map>

#include "server/storage/memory/memory_job_store.h"

namespace queue {

RetryOutcome MemoryJobStore::retry(const std::string& id, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  const auto found = rows_.find(id);
  return found == rows_.end() ? RetryOutcome::unknown : retry(found->second, now);
}

RetryOutcome MemoryJobStore::retry(Row& row, std::int64_t now) {
  Job& job = row.job;
  if (!ended(job.state)) return RetryOutcome::not_ended;
  if (job.state == JobState::succeeded) return RetryOutcome::succeeded;
  if (job.expired) return RetryOutcome::expired;
  assert(may_move(job.state, JobState::queued));
  job.state = JobState::queued;
  job.attempt = 0;
  job.started_at.reset();
  job.ended_at.reset();
  job.problem.reset();
  job.expires_at.reset();
  if (job.deadline && *job.deadline <= now) job.deadline.reset();
  if (job.run_after && *job.run_after > now) job.not_before = job.run_after;
  row.rank = rank_of(now, job.run_after, job.priority);
  ++job.revision;
  return RetryOutcome::queued;
}

ChangeOutcome MemoryJobStore::change(const std::string& id, const JobChange& change,
                                     std::optional<std::int64_t> revision) {
  const std::lock_guard lock(mutex_);
  const auto found = rows_.find(id);
  if (found == rows_.end()) return ChangeOutcome::unknown;
  Row& row = found->second;
  Job& job = row.job;
  if (revision && *revision != job.revision) return ChangeOutcome::other_revision;
  if (change.priority && ended(job.state)) return ChangeOutcome::ended;
  if (change.expires_at && job.expired) return ChangeOutcome::expired;
  if (change.priority) {
    row.rank += rank_of(0, {}, *change.priority) - rank_of(0, {}, job.priority);
    job.priority = *change.priority;
  }
  if (change.name) job.name = *change.name;
  if (change.labels) job.labels = *change.labels;
  if (change.expires_at) job.expires_at = *change.expires_at;
  ++job.revision;
  return ChangeOutcome::changed;
}

/// A batch goes with the last of its jobs.
std::map<std::string, MemoryJobStore::Row>::iterator MemoryJobStore::erase(std::map<std::string, Row>::iterator row) {
  const std::string batch = row->second.job.batch;
  const auto next = rows_.erase(row);
  const bool last =
      std::none_of(rows_.begin(), rows_.end(), [&](const auto& r) { return r.second.job.batch == batch; });
  if (last) batches_.erase(batch);
  return next;
}

std::optional<BatchState> MemoryJobStore::state_of_batch(const std::string& id) const {
  const auto found = batches_.find(id);
  if (found == batches_.end()) return std::nullopt;
  BatchState state{found->second, {}};
  for (const auto& [job_id, row] : rows_) {
    if (row.job.batch == id) ++state.jobs[row.job.state];
  }
  return state;
}

std::optional<BatchState> MemoryJobStore::find_batch(const std::string& id) {
  const std::lock_guard lock(mutex_);
  return state_of_batch(id);
}

BatchCancel MemoryJobStore::cancel_batch(const std::string& id, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  BatchCancel changed;
  for (auto& [job_id, row] : rows_) {
    if (row.job.batch != id) continue;
    const CancelOutcome outcome = cancel(row, now);
    if (outcome == CancelOutcome::cancelled) changed.cancelled.push_back(job_id);
    if (outcome == CancelOutcome::cancelling) changed.cancelling.push_back(job_id);
  }
  return changed;
}

BatchRetry MemoryJobStore::retry_batch(const std::string& id, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  BatchRetry retried;
  for (auto& [job_id, row] : rows_) {
    if (row.job.batch != id || retry(row, now) != RetryOutcome::queued) continue;
    retried.jobs.push_back(job_id);
    retried.suspects = retried.suspects || row.job.suspect;
  }
  return retried;
}

std::vector<std::string> MemoryJobStore::failing_batches() {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> ids;
  for (const auto& [id, batch] : batches_) {
    BatchState state = *state_of_batch(id);
    const bool open = state.jobs[JobState::queued] + state.jobs[JobState::running] > 0;
    if (open && batch.max_failed && state.jobs[JobState::failed] > *batch.max_failed) ids.push_back(id);
  }
  return ids;
}

MaintenanceResult MemoryJobStore::run_maintenance(std::int64_t now, std::int64_t expired_kept_ms, int limit) {
  const std::lock_guard lock(mutex_);
  MaintenanceResult upkeep;
  const auto most = static_cast<std::size_t>(limit);
  take_back_abandoned(now, most, upkeep);
  let_due_jobs_run(now, most, upkeep);
  fail_overdue(now, most, upkeep);
  expire(now, most, upkeep);
  forget(now, expired_kept_ms, most, upkeep);
  return upkeep;
}

void MemoryJobStore::take_back_abandoned(std::int64_t now, std::size_t limit, MaintenanceResult& upkeep) {
  for (auto& [id, row] : rows_) {
    if (row.job.state != JobState::running || row.lease_until > now) continue;
    if (upkeep.abandoned.size() == limit) return void(upkeep.more = true);
    give_back(row.job, now, {});
    upkeep.abandoned.push_back(id);
  }
}

void MemoryJobStore::let_due_jobs_run(std::int64_t now, std::size_t limit, MaintenanceResult& upkeep) {
  std::multimap<std::int64_t, Job*> due;
  for (auto& [id, row] : rows_) {
    if (row.job.not_before && *row.job.not_before <= now) due.emplace(*row.job.not_before, &row.job);
  }
  upkeep.due = !due.empty();
  upkeep.more = upkeep.more || due.size() > limit;
  for (auto next = due.begin(); next != due.end() && limit > 0; ++next, --limit) {
    upkeep.suspects_due = upkeep.suspects_due || next->second->suspect;
    next->second->not_before.reset();
    ++next->second->revision;
  }
}

void MemoryJobStore::fail_overdue(std::int64_t now, std::size_t limit, MaintenanceResult& upkeep) {
  for (auto& [id, row] : rows_) {
    Job& job = row.job;
    if (job.state != JobState::queued || !job.deadline || *job.deadline > now) continue;
    if (upkeep.overdue.size() == limit) return void(upkeep.more = true);
    end(job, JobState::failed, now);
    job.problem = deadline_exceeded();
    ++job.revision;
    upkeep.overdue.push_back(id);
  }
}

void MemoryJobStore::expire(std::int64_t now, std::size_t limit, MaintenanceResult& upkeep) {
  std::size_t done = 0;
  for (auto& [id, row] : rows_) {
    Job& job = row.job;
    if (!ended(job.state) || job.expired || !job.expires_at || *job.expires_at > now) continue;
    if (done++ == limit) return void(upkeep.more = true);
    job.expired = true;
    upkeep.artifacts.insert(upkeep.artifacts.end(), job.artifacts.begin(), job.artifacts.end());
    job.artifacts.clear();
    row.document.clear();
    ++job.revision;
    ++upkeep.expired;
  }
}

void MemoryJobStore::forget(std::int64_t now, std::int64_t expired_kept_ms, std::size_t limit,
                            MaintenanceResult& upkeep) {
  const auto most = static_cast<int>(limit);
  for (auto row = rows_.begin(); row != rows_.end() && upkeep.forgotten < most;) {
    const Job& job = row->second.job;
    const bool old = job.expired && *job.expires_at + expired_kept_ms <= now;
    upkeep.forgotten += old ? 1 : 0;
    row = old ? erase(row) : std::next(row);
  }
  for (auto reply = replies_.begin(); reply != replies_.end() && upkeep.forgotten < most;) {
    const bool old = reply->second.expires_at <= now;
    upkeep.forgotten += old ? 1 : 0;
    reply = old ? replies_.erase(reply) : std::next(reply);
  }
  upkeep.more = upkeep.more || upkeep.forgotten == most;
}

}  // namespace queue
