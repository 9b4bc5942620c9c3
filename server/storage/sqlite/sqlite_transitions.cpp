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
             "UPDATE jobs SET state = ?1, ended_at = ?2, cancel_requested = 0, revision = revision + 1,"
             " expires_at = coalesce(expires_at, ?2 + 1000 * expires_in_s)"
             " WHERE id = ?3 AND fence = ?4 AND state = 'running'",
             std::string(queue::name_of(state)), now, id, fence) == 1;
}

queue::CancelOutcome cancel_job(Database& database, const std::string& id, std::int64_t now) {
  if (database.change("UPDATE jobs SET state = 'cancelled', ended_at = ?1, not_before = NULL,"
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

queue::RetryOutcome retry_job(Database& database, const std::string& id, std::int64_t now) {
  const std::optional<queue::Job> job = read_job(database, id);
  if (!job) return queue::RetryOutcome::unknown;
  if (!queue::ended(job->state)) return queue::RetryOutcome::not_ended;
  if (job->state == queue::JobState::succeeded) return queue::RetryOutcome::succeeded;
  if (job->expired) return queue::RetryOutcome::expired;
  assert(queue::may_move(job->state, queue::JobState::queued));
  database.change("DELETE FROM problem_errors WHERE job_id = ?", id);
  database.change(
      "UPDATE jobs SET state = 'queued', attempt = 0, started_at = NULL, ended_at = NULL, expires_at = NULL,"
      " problem_code = NULL, problem_detail = NULL, deadline = iif(deadline <= ?1, NULL, deadline),"
      " not_before = iif(run_after > ?1, run_after, NULL), rank = ?2, revision = revision + 1 WHERE id = ?3",
      now, queue::rank_of(now, job->run_after, job->priority), id);
  return queue::RetryOutcome::queued;
}

class SqliteTransitions final : public queue::JobTransitions {
 public:
  explicit SqliteTransitions(Connections& connections) : connections_(connections) {}

  std::optional<queue::Claim> claim(const std::string& boot_id, std::int64_t now, std::int64_t lease_until,
                                    bool suspects, bool small) override {
    const auto work = [&](Database& database) -> std::optional<queue::Claim> {
      std::string id;
      bool is_last = false;
      {
        const std::string waiting = small ? "small_jobs_waiting WHERE large = 0" : "jobs_waiting WHERE true";
        Query next = database.query("SELECT id FROM jobs INDEXED BY " + waiting +
                                        " AND suspect = ? AND state = 'queued' AND not_before IS NULL"
                                        " AND (deadline IS NULL OR deadline > ?) ORDER BY rank, id LIMIT 2",
                                    std::int64_t{suspects}, now);
        if (!next.row()) return std::nullopt;
        id = next.text(0);
        is_last = !next.row();
      }
      queue::Claim claim = claim_job(database, id, {boot_id, lease_until}, now);
      claim.is_last = is_last;
      return claim;
    };
    std::optional<queue::Claim> claim = connections_.writer.run(work, Synced::with_next);
    if (!claim) return claim;
    const std::string id = claim->job.id;
    try {
      // Outside the writer, which a large document would delay; it exists as long as its job runs.
      claim->document =
          connections_.reader.run([&](Database& database) { return read_document(database, id).value(); });
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
               const std::vector<queue::Artifact>& artifacts, bool durable) override {
    const auto work = [&](Database& database) {
      if (!end(database, id, fence, now, queue::JobState::succeeded)) return false;
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

  queue::ReleaseOutcome release(const std::string& id, std::int64_t fence, std::int64_t now,
                                const queue::Release& release) override {
    return connections_.writer.run([&](Database& database) {
      Query released = database.query(std::string(released_columns) +
                                          " attempt = attempt - ?2, suspect = max(suspect, ?3),"
                                          " not_before = iif(cancel_requested, NULL, ?4)"
                                          " WHERE id = ?5 AND fence = ?6 AND state = 'running' RETURNING state",
                                      now, std::int64_t{!release.counts}, std::int64_t{release.suspect},
                                      release.not_before, id, fence);
      if (!released.row()) return queue::ReleaseOutcome::stale;
      return released.text(0) == "queued" ? queue::ReleaseOutcome::queued : queue::ReleaseOutcome::cancelled;
    });
  }

  queue::CancelOutcome cancel(const std::string& id, std::int64_t now) override {
    return connections_.writer.run([&](Database& database) { return cancel_job(database, id, now); });
  }

  queue::RetryOutcome retry(const std::string& id, std::int64_t now) override {
    return connections_.writer.run([&](Database& database) { return retry_job(database, id, now); });
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
