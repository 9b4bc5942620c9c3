#include "server/storage/memory/memory_job_store.h"

#include <algorithm>
#include <cassert>
#include <string_view>
#include <tuple>

namespace queue {
namespace {

bool matches(const Job& job, const JobFilter& filter) {
  if (filter.state && job.state != *filter.state) return false;
  if (!filter.batch.empty() && job.batch != filter.batch) return false;
  if (job.name.find(filter.text) == std::string::npos) return false;
  return std::all_of(filter.labels.begin(), filter.labels.end(), [&](const auto& label) {
    const auto found = job.labels.find(label.first);
    return found != job.labels.end() && found->second == label.second;
  });
}

bool waits(const Job& job) { return job.state == JobState::queued && !job.not_before; }

/// The order of claims.
auto place(const Job& job, std::int64_t rank) { return std::tuple(!job.suspect, rank, std::string_view(job.id)); }

}  // namespace

/// From running to queued, or to cancelled where that was asked for.
void MemoryJobStore::give_back(Job& job, std::int64_t now, const Release& how) {
  if (!how.counts) --job.attempt;
  job.suspect = job.suspect || how.suspect;
  ++job.revision;
  if (job.cancel_requested) return end(job, JobState::cancelled, now);
  assert(may_move(job.state, JobState::queued));
  job.state = JobState::queued;
  job.not_before = how.not_before;
}

std::optional<KeptReply> MemoryJobStore::kept(const ReplyKey& key, std::int64_t now) const {
  const auto found = replies_.find(key);
  if (found == replies_.end() || found->second.expires_at <= now) return std::nullopt;
  return found->second;
}

std::optional<KeptReply> MemoryJobStore::insert_job(const InsertRequest& admission, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  if (admission.reply) {
    if (auto earlier = kept(admission.reply->key, now)) return earlier;
    replies_.insert_or_assign(admission.reply->key, *admission.reply);
  }
  if (admission.batch) batches_.emplace(admission.batch->id, *admission.batch);
  for (const auto& [job, document] : admission.jobs) {
    assert(job.state == JobState::queued || job.state == JobState::succeeded);
    const std::int64_t rank = rank_of(job.created_at, job.run_after, job.priority);
    [[maybe_unused]] const bool is_new = rows_.try_emplace(job.id, Row{job, document, 0, {}, rank, 0}).second;
    assert(is_new);
  }
  return std::nullopt;
}

std::optional<KeptReply> MemoryJobStore::reply(const ReplyKey& key, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  return kept(key, now);
}

std::optional<Job> MemoryJobStore::find_by_content_key(const std::string& content_key, std::int64_t expires_after) {
  const std::lock_guard lock(mutex_);
  const auto newest = std::find_if(rows_.rbegin(), rows_.rend(), [&](const auto& row) {
    const Job& job = row.second.job;
    return job.state == JobState::succeeded && job.content_key == content_key && !job.expired &&
           (!job.expires_at || *job.expires_at > expires_after);
  });
  if (newest != rows_.rend()) return newest->second.job;
  return std::nullopt;
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
  if (row == rows_.end() || row->second.job.expired) return std::nullopt;
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

OwnerUse MemoryJobStore::owner_usage(const std::string& owner) {
  const std::lock_guard lock(mutex_);
  OwnerUse use;
  for (const auto& [id, row] : rows_) {
    if (row.job.owner != owner) continue;
    if (row.job.state == JobState::queued) ++use.queued_jobs;
    for (const Artifact& artifact : row.job.artifacts) use.artifact_bytes += static_cast<std::int64_t>(artifact.bytes);
  }
  return use;
}

QueueDepth MemoryJobStore::depth() {
  const std::lock_guard lock(mutex_);
  QueueDepth depth;
  for (const auto& [id, row] : rows_) {
    const Job& job = row.job;
    if (job.state != JobState::queued) continue;
    ++depth.queued_by_priority[job.priority];
    if (!waits(job)) {
      ++depth.delayed;
      continue;
    }
    const std::int64_t waits_since = std::max(job.created_at, job.run_after.value_or(job.created_at));
    depth.oldest_at = std::min(waits_since, depth.oldest_at.value_or(waits_since));
  }
  return depth;
}

std::optional<std::int64_t> MemoryJobStore::queue_position(const std::string& id, std::int64_t limit) {
  const std::lock_guard lock(mutex_);
  const auto found = rows_.find(id);
  if (found == rows_.end() || !waits(found->second.job)) {
    return std::nullopt;
  }
  const auto mine = place(found->second.job, found->second.rank);
  const auto before = std::count_if(rows_.begin(), rows_.end(), [&](const auto& entry) {
    const Row& row = entry.second;
    return waits(row.job) && place(row.job, row.rank) < mine;
  });
  return std::min<std::int64_t>(before, limit);
}

std::optional<Claim> MemoryJobStore::claim(const std::string& boot_id, std::int64_t now, std::int64_t lease_until,
                                           bool alone) {
  return claim_of([alone](const Job& job) { return job.suspect == alone; }, boot_id, now, lease_until);
}

std::optional<Claim> MemoryJobStore::claim_small(const std::string& boot_id, std::int64_t now,
                                                 std::int64_t lease_until) {
  return claim_of([](const Job& job) { return !job.suspect && !job.large; }, boot_id, now, lease_until);
}

std::optional<Claim> MemoryJobStore::claim_of(const std::function<bool(const Job&)>& wanted, const std::string& boot_id,
                                              std::int64_t now, std::int64_t lease_until) {
  const std::lock_guard lock(mutex_);
  Row* next = nullptr;
  for (auto& [id, row] : rows_) {
    if (!waits(row.job) || !wanted(row.job) || (row.job.deadline && *row.job.deadline <= now)) continue;
    if (next == nullptr || place(row.job, row.rank) < place(next->job, next->rank)) next = &row;
  }
  if (next == nullptr) return std::nullopt;
  next->job.state = JobState::running;
  next->job.started_at = now;
  next->job.not_before.reset();
  ++next->job.attempt;
  ++next->job.revision;
  ++next->fence;
  next->boot_id = boot_id;
  next->lease_until = lease_until;
  return Claim{next->job, next->document, next->fence};
}

MemoryJobStore::Row* MemoryJobStore::running(const std::string& id, std::int64_t fence) {
  const auto row = rows_.find(id);
  if (row == rows_.end() || row->second.job.state != JobState::running || row->second.fence != fence) return nullptr;
  return &row->second;
}

std::vector<Lease> MemoryJobStore::renew(const std::vector<Lease>& leases, std::int64_t until) {
  const std::lock_guard lock(mutex_);
  std::vector<Lease> lost;
  for (const Lease& lease : leases) {
    Row* row = running(lease.job_id, lease.fence);
    if (row == nullptr) lost.push_back(lease);
    if (row != nullptr) row->lease_until = until;
  }
  return lost;
}

bool MemoryJobStore::succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
                             const std::vector<Artifact>& artifacts, bool /*durable*/,
                             const std::vector<SmallImage>& small) {
  const std::lock_guard lock(mutex_);
  Row* row = running(id, fence);
  if (row == nullptr) return false;
  ++row->job.revision;
  end(row->job, JobState::succeeded, now);
  row->job.report = report;
  row->job.artifacts = artifacts;
  for (const auto& [sha256, bytes] : small) small_images_.try_emplace(sha256, bytes);
  return true;
}

bool MemoryJobStore::fail(const std::string& id, std::int64_t fence, std::int64_t now, const Problem& problem) {
  const std::lock_guard lock(mutex_);
  Row* row = running(id, fence);
  if (row == nullptr) return false;
  ++row->job.revision;
  end(row->job, JobState::failed, now);
  row->job.problem = problem;
  return true;
}

bool MemoryJobStore::finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  Row* row = running(id, fence);
  if (row == nullptr) return false;
  ++row->job.revision;
  end(row->job, JobState::cancelled, now);
  return true;
}

bool MemoryJobStore::release(const std::string& id, std::int64_t fence, std::int64_t now, const Release& how) {
  const std::lock_guard lock(mutex_);
  Row* row = running(id, fence);
  if (row == nullptr) return false;
  give_back(row->job, now, how);
  return true;
}

CancelOutcome MemoryJobStore::cancel(const std::string& id, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  const auto row = rows_.find(id);
  return row == rows_.end() ? CancelOutcome::unknown : cancel(row->second, now);
}

CancelOutcome MemoryJobStore::cancel(Row& row, std::int64_t now) {
  Job& job = row.job;
  if (ended(job.state)) return CancelOutcome::already_ended;
  if (job.state == JobState::running) {
    if (!job.cancel_requested) ++job.revision;
    job.cancel_requested = true;
    return CancelOutcome::cancelling;
  }
  ++job.revision;
  end(job, JobState::cancelled, now);
  return CancelOutcome::cancelled;
}

Removal MemoryJobStore::remove(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto row = rows_.find(id);
  if (row == rows_.end()) return {RemoveOutcome::unknown, {}};
  if (row->second.job.state == JobState::running) return {RemoveOutcome::running, {}};
  Removal removal{RemoveOutcome::removed, row->second.job.artifacts};
  erase(row);
  return removal;
}

int MemoryJobStore::recover(const std::string& boot_id, std::int64_t now) {
  const std::lock_guard lock(mutex_);
  int moved = 0;
  for (auto& [id, row] : rows_) {
    if (row.job.state != JobState::running || row.boot_id == boot_id) continue;
    give_back(row.job, now, {});
    ++moved;
  }
  return moved;
}

bool MemoryJobStore::references(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  return is_named(sha256);
}

std::optional<std::string> MemoryJobStore::small_image(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  const auto found = small_images_.find(sha256);
  return found == small_images_.end() ? std::nullopt : std::optional(found->second);
}

void MemoryJobStore::forget_small_image(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  if (!is_named(sha256)) small_images_.erase(sha256);
}

bool MemoryJobStore::is_named(const std::string& sha256) const {
  return std::any_of(rows_.begin(), rows_.end(), [&](const auto& row) {
    const auto& artifacts = row.second.job.artifacts;
    return std::any_of(artifacts.begin(), artifacts.end(), [&](const Artifact& a) { return a.sha256 == sha256; });
  });
}

bool MemoryJobStore::is_asset_referenced(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  return std::any_of(rows_.begin(), rows_.end(), [&](const auto& row) {
    const auto& assets = row.second.job.assets;
    return std::find(assets.begin(), assets.end(), sha256) != assets.end();
  });
}

}  // namespace queue
