/// Moves of jobs between states, of one job and of a batch.

#include <cassert>

#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/job_rows.h"

namespace storage::sqlite {
namespace {

/// Ends a job that runs under `fence`; false when there is none.
bool end(Database& database, const std::string& id, std::int64_t fence, std::int64_t now, queue::JobState state) {
  assert(queue::may_move(queue::JobState::running, state));
  return database.change(
             "UPDATE jobs SET state = ?1, ended_at = max(?2, started_at), moved_at = ?2, moved_for = '', "
             "cancel_requested = 0, revision = revision + "
             "1,"
             " expires_at = coalesce(expires_at, ?2 + 1000 * expires_in_s)"
             " WHERE id = ?3 AND fence = ?4 AND state = 'running'",
             std::string(queue::name_of(state)), now, id, fence) == 1;
}

queue::CancelOutcome cancel_job(Database& database, const std::string& id, std::int64_t now) {
  if (database.change(
          "UPDATE jobs SET state = 'cancelled', ended_at = max(?1, created_at), not_before = NULL, moved_at = ?1,"
          " moved_for = '',"
          " expires_at = coalesce(expires_at, ?1 + 1000 * expires_in_s), revision = revision + 1"
          " WHERE id = ?2 AND state = 'queued'",
          now, id) == 1) {
    return queue::CancelOutcome::cancelled;
  }
  if (database.change("UPDATE jobs SET revision = revision + (cancel_requested = 0), cancel_requested = 1"
                      " WHERE id = ? AND state = 'running'",
                      id) == 1) {
    return queue::CancelOutcome::cancelling;
  }
  return database.query("SELECT 1 FROM jobs WHERE id = ?", id).row() ? queue::CancelOutcome::already_ended
                                                                     : queue::CancelOutcome::unknown;
}

queue::RetryOutcome retry_job(Database& database, const std::string& id, std::int64_t now,
                              queue::SucceededJobs succeeded = queue::SucceededJobs::keep) {
  const std::optional<queue::Job> job = read_job(database, id);
  if (!job) return queue::RetryOutcome::unknown;
  if (!queue::ended(job->state)) return queue::RetryOutcome::not_ended;
  const bool has_succeeded = job->state == queue::JobState::succeeded;
  if (has_succeeded && succeeded == queue::SucceededJobs::keep) return queue::RetryOutcome::succeeded;
  if (job->expired) return queue::RetryOutcome::expired;
  assert(queue::may_move(job->state, queue::JobState::queued));
  for (const char* const table : {"problem_errors", "reports", "artifacts"})
    database.change(std::string("DELETE FROM ") + table + " WHERE job_id = ?", id);
  database.change(
      "UPDATE jobs SET state = 'queued', attempt = 0, started_at = NULL, ended_at = NULL, expires_at = NULL,"
      " moved_at = ?1, moved_for = 'retry by request',"
      " problem_code = NULL, problem_detail = NULL, deadline = iif(deadline <= ?1, NULL, deadline),"
      " not_before = iif(run_after > ?1, run_after, NULL), rank = ?2, revision = revision + 1 WHERE id = ?3",
      now, queue::rank_of(now, job->run_after, job->priority), id);
  return queue::RetryOutcome::queued;
}

/// A part of a statement: jobs of one owner that may be claimed at ?2, least rank first.
std::string waiting_jobs(const queue::ClaimFilter& filter, const std::string& owner) {
  const std::string index = filter.small ? "small_jobs_waiting WHERE large = 0 AND" : "jobs_waiting WHERE";
  return "SELECT id FROM jobs INDEXED BY " + index + " suspect = ?1 AND owner = " + owner +
         " AND state = 'queued' AND not_before IS NULL AND (deadline IS NULL OR deadline > ?2) ORDER BY rank, id";
}

/// The next job to claim, and whether it is the only one; none if no job passes the filter.
struct NextJob {
  std::string id;
  bool is_last = false;
};
std::optional<NextJob> find_next_job(Database& database, const queue::ClaimFilter& filter, std::int64_t now) {
  NextJob next;
  std::string owner, busy_owners = " ";  // names have no blanks
  for (const std::string& busy : filter.busy_owners) busy_owners.append(busy).append(" ");
  {
    Query first = database.query(
        "SELECT next.id, next.owner FROM owner_usage CROSS JOIN jobs AS next ON next.id = (" +
            waiting_jobs(filter, "owner_usage.owner") +
            " LIMIT 1) WHERE queued_jobs > 0 AND instr(?3, ' ' || owner_usage.owner || ' ') = 0"
            " ORDER BY running_jobs * 1.0 / next.weight, max(owner_usage.pass, (SELECT pass FROM latest_pass)),"
            " next.rank, next.id LIMIT 2",
        std::int64_t{filter.suspects}, now, busy_owners);
    if (!first.row()) return std::nullopt;
    next.id = first.text(0);
    owner = first.text(1);
    if (first.row()) return next;  // a job of another owner waits
  }
  Query second =
      database.query(waiting_jobs(filter, "?3") + " LIMIT 1 OFFSET 1", std::int64_t{filter.suspects}, now, owner);
  next.is_last = !second.row();
  return next;
}

class SqliteTransitions final : public queue::JobTransitions {
 public:
  explicit SqliteTransitions(Connections& connections) : connections_(connections) {}

  std::optional<queue::Claim> claim(const queue::ClaimTerms& terms, std::int64_t now,
                                    const queue::ClaimFilter& filter) override {
    const auto work = [&](Database& database) -> std::optional<queue::Claim> {
      const std::optional<NextJob> next = find_next_job(database, filter, now);
      if (!next) return std::nullopt;
      queue::Claim claim = claim_job(database, next->id, terms, now);
      claim.is_last = next->is_last;
      return claim;
    };
    std::optional<queue::Claim> claim = connections_.writer.run(work, Synced::with_next);
    if (!claim) return claim;
    const std::string id = claim->job.id;
    try {
      // Outside the writer, which a large document would delay; it exists as long as its job runs.
      connections_.reader.run([&](Database& database) {
        claim->document = read_document(database, id).value();
        claim->scene = read_scene(database, id);
        return 0;
      });
    } catch (...) {
      release(id, claim->fence, now, {});
      throw;
    }
    return claim;
  }

  std::vector<queue::Lease> renew(const std::vector<queue::Lease>& leases, std::int64_t until) override {
    const auto work = [&](Database& database) {
      std::vector<queue::Lease> lost;
      for (const queue::Lease& lease : leases) {
        const int renewed =
            database.change("UPDATE jobs SET lease_until = ? WHERE id = ? AND fence = ? AND state = 'running'", until,
                            lease.job_id, lease.fence);
        if (renewed == 0) lost.push_back(lease);
      }
      return lost;
    };
    return connections_.writer.run(work, Synced::with_next);
  }

  bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
               const std::vector<queue::Artifact>& artifacts, bool durable, bool rendered) override {
    const auto work = [&](Database& database) {
      if (!end(database, id, fence, now, queue::JobState::succeeded)) return false;
      if (!rendered) database.change("UPDATE jobs SET attempt = attempt - 1 WHERE id = ?", id);
      insert_report(database, id, report);
      insert_artifacts(database, id, artifacts, durable);
      return true;
    };
    return connections_.writer.run(work, synced(durable));
  }

  bool fail(const std::string& id, std::int64_t fence, std::int64_t now, const queue::Problem& problem) override {
    return connections_.writer.run([&](Database& database) {
      if (!end(database, id, fence, now, queue::JobState::failed)) return false;
      insert_problem(database, id, problem);
      return true;
    });
  }

  bool finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) override {
    return connections_.writer.run(
        [&](Database& database) { return end(database, id, fence, now, queue::JobState::cancelled); });
  }

  bool add_artifact(const std::string& id, std::int64_t fence, const queue::Artifact& artifact) override {
    return connections_.writer.run([&](Database& database) {
      const int changed = database.change(
          "UPDATE jobs SET revision = revision + 1 WHERE id = ? AND fence = ? AND state IN ('failed', 'cancelled')"
          " AND expired = 0 AND keep = 1",
          id, fence);
      if (changed == 1) insert_artifacts(database, id, {artifact}, true);
      return changed == 1;
    });
  }

  queue::ReleaseOutcome release(const std::string& id, std::int64_t fence, std::int64_t now,
                                const queue::Release& release) override {
    std::optional<std::int64_t> not_before;
    if (release.pause_ms > 0) not_before = now + release.pause_ms;
    return connections_.writer.run([&](Database& database) {
      Query released =
          database.query(std::string(released_columns) +
                             " ?8, attempt = attempt - ?2, suspect = max(suspect, ?3), large = max(large, ?4),"
                             " not_before = iif(cancel_requested, NULL, ?5)"
                             " WHERE id = ?6 AND fence = ?7 AND state = 'running' RETURNING state",
                         now, std::int64_t{!release.counts}, std::int64_t{release.suspect}, std::int64_t{release.large},
                         not_before, id, fence, release.code.empty() ? "" : release.code + " " + release.detail);
      if (!released.row()) return queue::ReleaseOutcome::stale;
      return released.text(0) == "queued" ? queue::ReleaseOutcome::queued : queue::ReleaseOutcome::cancelled;
    });
  }

  queue::CancelOutcome cancel(const std::string& id, std::int64_t now, bool durable) override {
    return connections_.writer.run([&](Database& database) { return cancel_job(database, id, now); }, synced(durable));
  }

  queue::RetryOutcome retry(const std::string& id, std::int64_t now, queue::SucceededJobs succeeded,
                            bool durable) override {
    return connections_.writer.run([&](Database& database) { return retry_job(database, id, now, succeeded); },
                                   synced(durable));
  }

 private:
  Connections& connections_;
};

std::vector<std::string> jobs_of(Database& database, const std::string& batch) {
  return database.query("SELECT id FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? ORDER BY id", batch).texts();
}

class SqliteBatches final : public queue::BatchStore {
 public:
  explicit SqliteBatches(Connections& connections) : connections_(connections) {}

  std::optional<queue::BatchState> find(const std::string& id) override {
    return connections_.reader.run([&](Database& database) { return read_batch(database, id); });
  }

  queue::BatchPage list(const std::string& cursor, int limit) override {
    return connections_.reader.run([&](Database& database) {
      const std::string before = cursor.empty() ? std::string("~") : cursor;  // greater than every id
      std::vector<std::string> ids =
          database
              .query("SELECT id FROM batches WHERE id < ? ORDER BY id DESC LIMIT ?", before, std::int64_t{limit} + 1)
              .texts();
      queue::BatchPage page;
      if (ids.size() > static_cast<std::size_t>(limit)) {
        ids.pop_back();
        page.next_cursor = ids.back();
      }
      for (const std::string& id : ids) page.items.push_back(read_batch(database, id).value());
      return page;
    });
  }

  queue::BatchRemoval remove_ended(const std::string& id, int limit) override {
    return connections_.writer.run([&](Database& database) {
      queue::BatchRemoval removal;
      const std::vector<std::string> ended = database
                                                 .query(
                                                     "SELECT id FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ?"
                                                     " AND state NOT IN ('queued', 'running') LIMIT ?",
                                                     id, std::int64_t{limit})
                                                 .texts();
      for (const std::string& job : ended) {
        const std::vector<queue::Artifact> artifacts = read_artifacts(database, job);
        removal.artifacts.insert(removal.artifacts.end(), artifacts.begin(), artifacts.end());
        removal.jobs.push_back(delete_job(database, job).value());
      }
      return removal;
    });
  }

  queue::BatchCancel cancel(const std::string& id, std::int64_t now) override {
    return connections_.writer.run([&](Database& database) {
      queue::BatchCancel changed;
      for (const std::string& job : jobs_of(database, id)) {
        const queue::CancelOutcome outcome = cancel_job(database, job, now);
        if (outcome == queue::CancelOutcome::cancelled) changed.cancelled.push_back(job);
        if (outcome == queue::CancelOutcome::cancelling) changed.cancelling.push_back(job);
      }
      return changed;
    });
  }

  queue::BatchRetry retry(const std::string& id, std::int64_t now) override {
    return connections_.writer.run([&](Database& database) {
      queue::BatchRetry retried;
      for (const std::string& job : jobs_of(database, id)) {
        if (retry_job(database, job, now) == queue::RetryOutcome::queued) retried.jobs.push_back(job);
      }
      Query suspect = database.query(
          "SELECT 1 FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? AND suspect = 1 AND state = 'queued' LIMIT 1",
          id);
      retried.suspects = suspect.row();
      return retried;
    });
  }

  std::vector<std::string> list_failing() override {
    return connections_.reader.run([&](Database& database) {
      return database
          .query(
              "SELECT id FROM batches WHERE max_failed IS NOT NULL AND max_failed <"
              " (SELECT count(*) FROM jobs WHERE batch_id = batches.id AND state = 'failed')"
              " AND EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id AND state IN ('queued', 'running'))")
          .texts();
    });
  }

 private:
  Connections& connections_;
};

}  // namespace

std::unique_ptr<queue::JobTransitions> make_job_transitions(Connections& connections) {
  return std::make_unique<SqliteTransitions>(connections);
}

std::unique_ptr<queue::BatchStore> make_batch_store(Connections& connections) {
  return std::make_unique<SqliteBatches>(connections);
}

}  // namespace storage::sqlite
