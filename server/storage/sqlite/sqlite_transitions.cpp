/// Moves of jobs between states.

#include <cassert>

#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/job_moves.h"
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

}  // namespace

std::unique_ptr<queue::JobTransitions> make_job_transitions(Connections& connections) {
  return std::make_unique<SqliteTransitions>(connections);
}

}  // namespace storage::sqlite
