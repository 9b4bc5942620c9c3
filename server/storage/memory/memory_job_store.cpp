#include "server/storage/memory/memory_job_store.h"

#include <algorithm>
#include <cassert>

namespace jobs {
namespace {

bool matches(const Job& job, const JobFilter& filter) {
  if (filter.state && job.state != *filter.state) return false;
  if (job.name.find(filter.text) == std::string::npos) return false;
  return std::all_of(filter.labels.begin(), filter.labels.end(), [&](const auto& label) {
    const auto found = job.labels.find(label.first);
    return found != job.labels.end() && found->second == label.second;
  });
}

void end(Job& job, JobState state, std::int64_t now) {
  assert(may_move(job.state, state));
  job.state = state;
  job.ended_at = now;
  job.cancel_requested = false;
}

/// From running to queued, or to cancelled where that was asked for.
void give_back(Job& job, std::int64_t now, bool counts) {
  if (!counts) --job.attempt;
  if (job.cancel_requested) return end(job, JobState::cancelled, now);
  assert(may_move(job.state, JobState::queued));
  job.state = JobState::queued;
}

}  // namespace

void MemoryJobStore::submit(const Job& job, const std::string& document) {
  const std::lock_guard lock(mutex_);
  assert(job.state == JobState::queued);
  [[maybe_unused]] const bool is_new = rows_.try_emplace(job.id, Row{job, document, 0, {}}).second;
  assert(is_new);
}

std::optional<Job> MemoryJobStore::find(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto row = rows_.find(id);
  if (row == rows_.end()) return std::nullopt;
  return row->second.job;
}

std::optional<std::string> MemoryJobStore::document(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto row = rows_.find(id);
  if (row == rows_.end()) return std::nullopt;
  return row->second.document;
}

JobPage MemoryJobStore::list(const JobFilter& filter, const std::string& cursor, int limit) {
  const std::lock_guard lock(mutex_);
  JobPage page;
  for (auto row = cursor.empty() ? rows_.end() : rows_.lower_bound(cursor); row != rows_.begin();) {
    --row;
    if (!matches(row->second.job, filter)) continue;
    if (page.items.size() == static_cast<std::size_t>(limit)) {
      page.next_cursor = page.items.back().id;
      break;
    }
    page.items.push_back(row->second.job);
  }
  return page;
}

std::int64_t MemoryJobStore::count(JobState state) {
  const std::lock_guard lock(mutex_);
  return std::count_if(rows_.begin(), rows_.end(), [&](const auto& row) { return row.second.job.state == state; });
}

std::optional<Claim> MemoryJobStore::claim(const std::string& boot_id, std::int64_t now, bool alone) {
  const std::lock_guard lock(mutex_);
  Row* next = nullptr;
  for (auto& [id, row] : rows_) {
    if (row.job.state != JobState::queued || row.job.suspect != alone) continue;
    if (next == nullptr || row.job.priority > next->job.priority) next = &row;
  }
  if (next == nullptr) return std::nullopt;
  next->job.state = JobState::running;
  next->job.started_at = now;
  ++next->job.attempt;
  ++next->fence;
  next->boot_id = boot_id;
  return Claim{next->job, next->document, next->fence};
}

MemoryJobStore::Row* MemoryJobStore::running(const std::string& id, std::int64_t fence) {
  const auto row = rows_.find(id);
  if (row == rows_.end() || row->second.job.state != JobState::running || row->second.fence != fence) return nullptr;
  return &row->second;
}

bool MemoryJobStore::succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
                             const std::vector<Artifact>& artifacts) {
  const std::lock_guard lock(mutex_);
  Row* row = running(id, fence);
  if (row == nullptr) return false;
  end(row->job, JobState::succeeded, now);
  row->job.report = report;
  row->job.artifacts = artifacts;
  return true;
}

bool MemoryJobStore::fail(const std::string& id, std::int64_t fence, std::int64_t now, const Problem& problem) {
  const std::lock_guard lock(mutex_);
  Row* row = running(id, fence);
  if (row == nullptr) return false;
  end(row->job, JobState::failed, now);
  row->job.problem = problem;
  return true;
}

bool MemoryJobStore::finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  Row* row = running(id, fence);
  if (row == nullptr) return false;
  end(row->job, JobState::cancelled, now);
  return true;
}

bool MemoryJobStore::release(const std::string& id, std::int64_t fence, std::int64_t now, bool counts, bool suspect) {
  const std::lock_guard lock(mutex_);
  Row* row = running(id, fence);
  if (row == nullptr) return false;
  row->job.suspect = row->job.suspect || suspect;
  give_back(row->job, now, counts);
  return true;
}

CancelOutcome MemoryJobStore::cancel(const std::string& id, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  const auto row = rows_.find(id);
  if (row == rows_.end()) return CancelOutcome::unknown;
  Job& job = row->second.job;
  if (ended(job.state)) return CancelOutcome::already_ended;
  if (job.state == JobState::running) {
    job.cancel_requested = true;
    return CancelOutcome::cancelling;
  }
  end(job, JobState::cancelled, now);
  return CancelOutcome::cancelled;
}

Removal MemoryJobStore::remove(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto row = rows_.find(id);
  if (row == rows_.end()) return {RemoveOutcome::unknown, {}};
  if (row->second.job.state == JobState::running) return {RemoveOutcome::running, {}};
  Removal removal{RemoveOutcome::removed, row->second.job.artifacts};
  rows_.erase(row);
  return removal;
}

int MemoryJobStore::recover(const std::string& boot_id, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  int moved = 0;
  for (auto& [id, row] : rows_) {
    if (row.job.state != JobState::running || row.boot_id == boot_id) continue;
    give_back(row.job, now, false);
    ++moved;
  }
  return moved;
}

bool MemoryJobStore::references(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  return std::any_of(rows_.begin(), rows_.end(), [&](const auto& row) {
    const auto& artifacts = row.second.job.artifacts;
    return std::any_of(artifacts.begin(), artifacts.end(), [&](const Artifact& a) { return a.sha256 == sha256; });
  });
}

bool MemoryJobStore::names_asset(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  return std::any_of(rows_.begin(), rows_.end(), [&](const auto& row) {
    const auto& assets = row.second.job.assets;
    return std::find(assets.begin(), assets.end(), sha256) != assets.end();
  });
}

}  // namespace jobs
