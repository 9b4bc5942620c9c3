/// Moves of jobs between states, of one job and of a batch.

#include <cassert>

#include "server/queue/job_rows.h"

namespace queue {
namespace {

/// Ends a job that runs under `fence`; false when there is none. `synced`: its artifacts are durable.
bool end(sql::Database& database, const std::string& id, std::int64_t fence, std::int64_t now, JobState state,
         bool synced = true) {
  assert(may_move(JobState::running, state));
  return database.change(
             "UPDATE jobs SET state = ?1, ended_at = max(?2, started_at), moved_at = ?2, moved_for = '',"
             " cancel_requested = 0, artifacts_synced = ?5, revision = revision + 1,"
             " expires_at = coalesce(expires_at, ?2 + 1000 * expires_in_s)"
             " WHERE id = ?3 AND fence = ?4 AND state = 'running'",
             state, now, id, fence, synced) == 1;
}

CancelOutcome cancel_job(sql::Database& database, const std::string& id, std::int64_t now) {
  if (database.change(
          "UPDATE jobs SET state = 'cancelled', ended_at = max(?1, created_at), not_before = NULL, moved_at = ?1,"
          " moved_for = '',"
          " expires_at = coalesce(expires_at, ?1 + 1000 * expires_in_s), revision = revision + 1"
          " WHERE id = ?2 AND state = 'queued'",
          now, id) == 1) {
    return CancelOutcome::cancelled;
  }
  if (database.change("UPDATE jobs SET revision = revision + 1 - cancel_requested, cancel_requested = 1"
                      " WHERE id = ? AND state = 'running'",
                      id) == 1) {
    return CancelOutcome::cancelling;
  }
  return database.query("SELECT 1 FROM jobs WHERE id = ?", id).row() ? CancelOutcome::already_ended
                                                                     : CancelOutcome::unknown;
}

RetryOutcome retry_job(sql::Database& database, const std::string& id, std::int64_t now,
                       SucceededJobs succeeded = SucceededJobs::keep) {
  lock_job(database, id);
  const std::optional<Job> job = read_job(database, id);
  if (!job) return RetryOutcome::unknown;
  if (!ended(job->state)) return RetryOutcome::not_ended;
  const bool has_succeeded = job->state == JobState::succeeded;
  if (has_succeeded && succeeded == SucceededJobs::keep) return RetryOutcome::succeeded;
  if (job->expired) return RetryOutcome::expired;
  assert(may_move(job->state, JobState::queued));
  for (const char* const table : {"problem_errors", "reports", "artifacts"})
    database.change(std::string("DELETE FROM ") + table + " WHERE job_id = ?", id);
  database.change(
      "UPDATE jobs SET state = 'queued', attempt = 0, started_at = NULL, ended_at = NULL, expires_at = NULL,"
      " moved_at = ?1, moved_for = 'retry by request',"
      " problem_code = NULL, problem_detail = NULL, deadline = CASE WHEN deadline > ?1 THEN deadline END,"
      " not_before = CASE WHEN run_after > ?1 THEN run_after END, rank = ?2, revision = revision + 1 WHERE id = ?3",
      now, rank_of(now, job->run_after, job->priority), id);
  return RetryOutcome::queued;
}

std::optional<BatchState> read_batch(sql::Database& database, const std::string& id) {
  sql::Query row =
      database.query("SELECT owner, name, sweep, created_at, max_failed, size FROM batches WHERE id = ?", id);
  if (!row.row()) return std::nullopt;
  BatchState state;
  Batch& batch = state.batch;
  batch.id = id;
  row.take(batch.owner, batch.name, batch.sweep, batch.created_at, batch.max_failed, batch.size);
  sql::Query counts =
      database.query("SELECT state, count(*) FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? GROUP BY state", id);
  while (counts.row()) state.jobs.emplace(job_state(counts.text(0)).value(), counts.integer(1));
  return state;
}

/// A part of a statement: jobs of one owner that may be claimed at ?2, least rank first.
std::string waiting_jobs(const ClaimFilter& filter, const std::string& owner) {
  const std::string index = filter.small ? "small_jobs_waiting WHERE large = 0 AND" : "jobs_waiting WHERE";
  return "SELECT id FROM jobs INDEXED BY " + index + " suspect = ?1 AND owner = " + owner +
         " AND state = 'queued' AND not_before IS NULL AND (deadline IS NULL OR deadline > ?2) ORDER BY rank, id";
}

struct NextJob {
  std::string id;
  bool is_last = false;  ///< no other job passes the filter
};

/// The first job of the first owner that has one which no other process is claiming. `is_last` stays false: the jobs
/// that others are claiming may come back.
std::optional<NextJob> lock_next_job(sql::Database& database, const ClaimFilter& filter, std::int64_t now,
                                     const std::vector<std::string>& owners) {
  for (const std::string& owner : owners) {
    sql::Query job =
        database.query(waiting_jobs(filter, "?3") + " LIMIT 1" + database.skip_locked(), filter.suspects, now, owner);
    if (job.row()) return NextJob{job.text(0)};
  }
  return std::nullopt;
}

/// The next job to claim; none if no job passes the filter.
std::optional<NextJob> find_next_job(sql::Database& database, const ClaimFilter& filter, std::int64_t now) {
  std::vector<NextJob> next_of_owners;
  std::vector<std::string> owners;
  std::string busy_owners = " ";  // names have no blanks
  for (const std::string& busy : filter.busy_owners) busy_owners.append(busy).append(" ");
  {
    sql::Query first = database.query(
        "SELECT next.id, next.owner FROM owners CROSS JOIN jobs AS next WHERE next.id = (" +
            waiting_jobs(filter, "owners.owner") +
            " LIMIT 1) AND queued_jobs > 0 AND instr(?3, ' ' || owners.owner || ' ') = 0"
            " ORDER BY running_jobs * 1.0 / next.weight, max(owners.pass, (SELECT pass FROM latest_pass)),"
            " next.rank, next.id LIMIT ?4",
        filter.suspects, now, busy_owners, database.is_shared() ? 16 : 2);
    while (first.row()) {
      next_of_owners.push_back({first.text(0)});
      owners.push_back(first.text(1));
    }
  }
  if (database.is_shared()) return lock_next_job(database, filter, now, owners);
  if (owners.size() != 1) return owners.empty() ? std::nullopt : std::optional(next_of_owners.front());
  sql::Query second =
      database.query(waiting_jobs(filter, "?3") + " LIMIT 1 OFFSET 1", filter.suspects, now, owners.front());
  next_of_owners.front().is_last = !second.row();
  return next_of_owners.front();
}

/// Adds a claim of the job to the passes.
void count_turn(sql::Database& database, const Job& job) {
  if (database.is_shared()) return database.post("SELECT count_turn(?, ?)", job.owner, pass_of_turn / job.weight);
  database.post("UPDATE latest_pass SET pass = max(pass, (SELECT pass FROM owner_usage WHERE owner = ?))", job.owner);
  database.post("UPDATE owner_usage SET pass = (SELECT pass FROM latest_pass) + ? / ? WHERE owner = ?", pass_of_turn,
                job.weight, job.owner);
}

/// Sets the document of the claim, and the scene that it patches. Precondition: the job exists.
void read_claimed_document(sql::Database& database, Claim& claim) {
  sql::Query row = database.query(
      "SELECT documents.document, scenes.document FROM documents LEFT JOIN scenes ON scenes.id = documents.scene_id"
      " WHERE job_id = ?",
      claim.job.id);
  row.row();
  row.take(claim.document, claim.scene);
}

std::vector<std::string> jobs_of(sql::Database& database, const std::string& batch) {
  return database.texts(
      std::string("SELECT id FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? ORDER BY id") + database.locking(),
      batch);
}

}  // namespace

std::optional<Claim> JobTransitions::claim(const ClaimTerms& terms, std::int64_t now, const ClaimFilter& filter) {
  bool has_document = false;
  const auto work = [&](sql::Database& database) -> std::optional<Claim> {
    const std::optional<NextJob> next = find_next_job(database, filter, now);
    if (!next) return std::nullopt;
    Claim claim;
    claim.fence = database.number(
        "UPDATE jobs SET state = 'running', started_at = max(?1, created_at), moved_at = ?1, moved_for = '',"
        " attempt = attempt + 1, fence = fence + 1, boot_id = ?2, lease_until = ?3, revision = revision + 1"
        " WHERE id = ?4 RETURNING fence",
        now, terms.boot_id, terms.lease_until, next->id);
    claim.job = read_job(database, next->id).value();
    claim.is_last = next->is_last;
    has_document = database.is_shared();
    if (has_document) read_claimed_document(database, claim);
    count_turn(database, claim.job);
    return claim;
  };
  std::optional<Claim> claim = transactions_.write(work, sql::Synced::with_next);
  if (!claim || has_document) return claim;
  const std::string id = claim->job.id;
  try {
    // Outside the only writer, which a large document would delay; it exists as long as its job runs.
    transactions_.read([&](sql::Database& database) {
      read_claimed_document(database, *claim);
      return 0;
    });
  } catch (...) {
    release(id, claim->fence, now, {});
    throw;
  }
  return claim;
}

std::vector<Lease> JobTransitions::renew(const std::vector<Lease>& leases, std::int64_t until) {
  const auto work = [&](sql::Database& database) {
    std::vector<Lease> lost;
    for (const Lease& lease : leases) {
      const int renewed =
          database.change("UPDATE jobs SET lease_until = ? WHERE id = ? AND fence = ? AND state = 'running'", until,
                          lease.job_id, lease.fence);
      if (renewed == 0) lost.push_back(lease);
    }
    return lost;
  };
  return transactions_.write(work, sql::Synced::with_next);
}

bool JobTransitions::succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
                             const std::vector<Artifact>& artifacts, bool durable, bool rendered) {
  const auto work = [&](sql::Database& database) {
    if (!end(database, id, fence, now, JobState::succeeded, durable)) return false;
    if (!rendered) database.change("UPDATE jobs SET attempt = attempt - 1 WHERE id = ?", id);
    insert_report(database, id, report);
    insert_artifacts(database, id, artifacts);
    return true;
  };
  return transactions_.write(work, sql::synced(durable));
}

bool JobTransitions::fail(const std::string& id, std::int64_t fence, std::int64_t now, const Problem& problem) {
  return transactions_.write([&](sql::Database& database) {
    if (!end(database, id, fence, now, JobState::failed)) return false;
    insert_problem(database, id, problem);
    return true;
  });
}

bool JobTransitions::finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) {
  return transactions_.write(
      [&](sql::Database& database) { return end(database, id, fence, now, JobState::cancelled); });
}

bool JobTransitions::add_artifact(const std::string& id, std::int64_t fence, const Artifact& artifact) {
  return transactions_.write([&](sql::Database& database) {
    const int changed = database.change(
        "UPDATE jobs SET revision = revision + 1 WHERE id = ? AND fence = ? AND state IN ('failed', 'cancelled')"
        " AND expired = 0 AND keep = 1",
        id, fence);
    if (changed == 1) insert_artifacts(database, id, {artifact});
    return changed == 1;
  });
}

ReleaseOutcome JobTransitions::release(const std::string& id, std::int64_t fence, std::int64_t now,
                                       const Release& release) {
  std::optional<std::int64_t> not_before;
  if (release.pause_ms > 0) not_before = now + release.pause_ms;
  return transactions_.write([&](sql::Database& database) {
    sql::Query released =
        database.query(std::string(released_columns) +
                           " ?8, attempt = attempt - ?2, suspect = max(suspect, ?3), large = max(large, ?4),"
                           " not_before = CASE cancel_requested WHEN 0 THEN ?5 END"
                           " WHERE id = ?6 AND fence = ?7 AND state = 'running' RETURNING state",
                       now, !release.counts, release.suspect, release.large, not_before, id, fence,
                       release.code.empty() ? "" : release.code + " " + release.detail);
    if (!released.row()) return ReleaseOutcome::stale;
    return released.text(0) == "queued" ? ReleaseOutcome::queued : ReleaseOutcome::cancelled;
  });
}

CancelOutcome JobTransitions::cancel(const std::string& id, std::int64_t now, bool durable) {
  return transactions_.write(
      [&](sql::Database& database) {
        lock_job(database, id);
        return cancel_job(database, id, now);
      },
      sql::synced(durable));
}

RetryOutcome JobTransitions::retry(const std::string& id, std::int64_t now, SucceededJobs succeeded, bool durable) {
  return transactions_.write([&](sql::Database& database) { return retry_job(database, id, now, succeeded); },
                             sql::synced(durable));
}

std::optional<BatchState> BatchStore::find(const std::string& id) {
  return transactions_.read([&](sql::Database& database) { return read_batch(database, id); });
}

BatchPage BatchStore::list(const std::string& cursor, int limit) {
  return transactions_.read([&](sql::Database& database) {
    const std::string before = cursor.empty() ? std::string("~") : cursor;  // greater than every id
    std::vector<std::string> ids =
        database.texts("SELECT id FROM batches WHERE id < ? ORDER BY id DESC LIMIT ?", before, limit + 1);
    BatchPage page;
    if (ids.size() > static_cast<std::size_t>(limit)) {
      ids.pop_back();
      page.next_cursor = ids.back();
    }
    for (const std::string& id : ids) page.items.push_back(read_batch(database, id).value());
    return page;
  });
}

BatchRemoval BatchStore::remove_ended(const std::string& id, int limit) {
  return transactions_.write([&](sql::Database& database) {
    BatchRemoval removal;
    const std::vector<std::string> ended = database.texts(
        "SELECT id FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? AND state NOT IN ('queued', 'running')"
        " LIMIT ?",
        id, limit);
    for (const std::string& job : ended) {
      const std::vector<Artifact> artifacts = read_artifacts(database, job);
      removal.artifacts.insert(removal.artifacts.end(), artifacts.begin(), artifacts.end());
      removal.jobs.push_back(delete_job(database, job).value());
    }
    return removal;
  });
}

BatchCancel BatchStore::cancel(const std::string& id, std::int64_t now) {
  return transactions_.write([&](sql::Database& database) {
    BatchCancel changed;
    for (const std::string& job : jobs_of(database, id)) {
      const CancelOutcome outcome = cancel_job(database, job, now);
      if (outcome == CancelOutcome::cancelled) changed.cancelled.push_back(job);
      if (outcome == CancelOutcome::cancelling) changed.cancelling.push_back(job);
    }
    return changed;
  });
}

BatchRetry BatchStore::retry(const std::string& id, std::int64_t now) {
  return transactions_.write([&](sql::Database& database) {
    BatchRetry retried;
    for (const std::string& job : jobs_of(database, id)) {
      if (retry_job(database, job, now) == RetryOutcome::queued) retried.jobs.push_back(job);
    }
    sql::Query suspect = database.query(
        "SELECT 1 FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? AND suspect = 1 AND state = 'queued' LIMIT 1",
        id);
    retried.suspects = suspect.row();
    return retried;
  });
}

std::vector<std::string> BatchStore::list_failing() {
  return transactions_.texts(
      "SELECT id FROM batches WHERE max_failed IS NOT NULL AND max_failed <"
      " (SELECT count(*) FROM jobs WHERE batch_id = batches.id AND state = 'failed')"
      " AND EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id AND state IN ('queued', 'running'))");
}

}  // namespace queue
