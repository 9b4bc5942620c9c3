/// Maintenance in time: ended leases, due jobs, deadlines, expiry, recovery.

#include <limits>

#include "server/queue/job_rows.h"

namespace queue {
namespace {

constexpr const char* aged_jobs =
    "SELECT id FROM jobs INDEXED BY jobs_ended WHERE ended_at IS NOT NULL AND expired = 0"
    " AND ((state = 'succeeded' AND ended_at <= ?) OR (state IN ('failed', 'cancelled') AND ended_at <= ?))";

constexpr const char* with_artifacts =
    "SELECT id FROM jobs INDEXED BY jobs_ended WHERE state = 'succeeded' AND ended_at IS NOT NULL AND expired = 0"
    " ORDER BY ended_at LIMIT 1";

/// Moments from the retention.
struct Limits {
  Limits(std::int64_t moment, const Retention& retention)
      : now(moment),
        lease_ended_before(now - retention.lease_grace_ms),
        delete_before(now - retention.expired_ms),
        delete_unkept_before(now - retention.unkept_ms),
        succeeded_before(now - retention.succeeded_ms.value_or(now)),
        failed_before(now - retention.failed_ms.value_or(now)),
        artifact_bytes(retention.artifact_bytes.value_or(std::numeric_limits<std::int64_t>::max())) {}
  [[nodiscard]] bool has_artifact_bytes() const { return artifact_bytes != std::numeric_limits<std::int64_t>::max(); }
  std::int64_t now, lease_ended_before, delete_before, delete_unkept_before, succeeded_before, failed_before,
      artifact_bytes;
};

std::string oldest_of(const std::string& state) {
  return " OR (SELECT min(ended_at) FROM jobs INDEXED BY jobs_ended WHERE state = '" + state +
         "' AND ended_at IS NOT NULL AND expired = 0)";
}

/// One step inside a transaction.
struct Step {
  sql::Database& database;
  const Limits& limits;
  const std::int64_t limit;
  const std::int64_t now = limits.now;
  MaintenanceResult result{};

  static bool is_due(sql::Database& database, const Limits& limits) {
    if (limits.has_artifact_bytes() && read_artifact_bytes(database) > limits.artifact_bytes &&
        database.query(with_artifacts).row())
      return true;
    // Minima, since a planner that has seen few jobs would rather read all of them than an index for a range.
    return database.number(
               "SELECT (SELECT min(not_before) FROM jobs INDEXED BY jobs_delayed WHERE not_before IS NOT NULL) <= ?1"
               " OR (SELECT min(deadline) FROM jobs INDEXED BY jobs_by_deadline"
               "   WHERE state = 'queued' AND deadline IS NOT NULL) <= ?1"
               " OR EXISTS (SELECT 1 FROM jobs INDEXED BY jobs_by_state WHERE state = 'running' AND lease_until <= ?4)"
               " OR (SELECT min(expires_at) FROM jobs INDEXED BY jobs_expiring"
               "   WHERE ended_at IS NOT NULL AND expired = 0 AND expires_at IS NOT NULL) <= ?1"
               " OR (SELECT min(expires_at) FROM jobs INDEXED BY jobs_expired WHERE expired = 1) <= ?2"
               " OR (SELECT min(ended_at) FROM jobs INDEXED BY jobs_not_kept WHERE keep = 0 AND ended_at IS NOT NULL) "
               "<= ?3"
               " OR (SELECT min(expires_at) FROM replies) <= ?1" +
                   oldest_of("succeeded") + " <= ?5" + oldest_of("failed") + " <= ?6" + oldest_of("cancelled") +
                   " <= ?6",
               limits.now, limits.delete_before, limits.delete_unkept_before, limits.lease_ended_before,
               limits.succeeded_before, limits.failed_before) != 0;
  }

  [[nodiscard]] std::optional<std::string> oldest_with_artifacts() const {
    return database.first_text(std::string(with_artifacts) + database.skip_locked());
  }

  /// Ids of at most `limit` jobs, which no other process is changing.
  template <class... Moments>
  std::vector<std::string> find(const std::string& sql, Moments... moments) {
    return database.texts(sql + " LIMIT ?" + database.skip_locked(), moments..., limit);
  }

  void collect_artifacts_of(const std::string& id) {
    const std::vector<Artifact> artifacts = read_artifacts(database, id);
    result.artifacts.insert(result.artifacts.end(), artifacts.begin(), artifacts.end());
  }

  void release_abandoned() {
    for (const std::string& id :
         find("SELECT id FROM jobs INDEXED BY jobs_by_state WHERE state = 'running' AND lease_until <= ?",
              limits.lease_ended_before)) {
      sql::Query released = database.query(
          std::string(released_columns) + " 'lease_ended ', attempt = attempt - 1 WHERE id = ?2 RETURNING state", now,
          id);
      released.row();
      (released.text(0) == "queued" ? result.abandoned : result.cancelled).push_back(id);
    }
  }

  void clear_not_before() {
    std::vector<std::string> ids;
    {
      sql::Query due = database.query(
          "SELECT id, suspect FROM jobs INDEXED BY jobs_delayed WHERE not_before <= ? ORDER BY not_before LIMIT ?" +
              std::string(database.skip_locked()),
          now, limit);
      while (due.row()) {
        ids.push_back(due.text(0));
        result.suspects_due = result.suspects_due || due.integer(1) != 0;
      }
    }
    for (const std::string& id : ids) {
      database.change("UPDATE jobs SET not_before = NULL, revision = revision + 1 WHERE id = ?", id);
    }
    result.due = !ids.empty();
  }

  void fail_overdue() {
    result.overdue =
        find("SELECT id FROM jobs INDEXED BY jobs_by_deadline WHERE state = 'queued' AND deadline <= ?", now);
    for (const std::string& id : result.overdue) {
      static_assert(may_move(JobState::queued, JobState::failed));
      database.change(
          "UPDATE jobs SET state = 'failed', ended_at = max(?1, created_at), not_before = NULL, moved_at = ?1,"
          " revision = revision + 1, expires_at = coalesce(expires_at, ?1 + 1000 * expires_in_s) WHERE id = ?2",
          now, id);
      insert_problem(database, id, deadline_exceeded());
    }
  }

  void expire() {
    for (const std::string& id : find("SELECT id FROM jobs INDEXED BY jobs_expiring"
                                      " WHERE ended_at IS NOT NULL AND expired = 0 AND expires_at <= ?",
                                      now))
      expire(id, result.expired);
    for (const std::string& id : find(aged_jobs, limits.succeeded_before, limits.failed_before))
      expire(id, result.aged);
    while (result.evicted < limit && read_artifact_bytes(database) > limits.artifact_bytes) {
      const std::optional<std::string> oldest = oldest_with_artifacts();
      if (!oldest) return;
      expire(*oldest, result.evicted);
    }
  }

  void expire(const std::string& id, int& count) {
    collect_artifacts_of(id);
    database.change("DELETE FROM artifacts WHERE job_id = ?", id);
    database.change("DELETE FROM documents WHERE job_id = ?", id);
    database.change(
        "UPDATE jobs SET expired = 1, expires_at = CASE WHEN expires_at < ?1 THEN expires_at ELSE ?1 END,"
        " revision = revision + 1 WHERE id = ?2",
        now, id);
    ++count;
  }

  void delete_unkept() {
    for (const std::string& id : find("SELECT id FROM jobs INDEXED BY jobs_not_kept WHERE keep = 0 AND ended_at <= ?",
                                      limits.delete_unkept_before)) {
      collect_artifacts_of(id);
      result.deleted += database.change("DELETE FROM jobs WHERE id = ?", id);
    }
  }

  void delete_expired() {
    result.deleted += database.change(
        "DELETE FROM jobs WHERE id IN (SELECT id FROM jobs INDEXED BY jobs_expired"
        " WHERE expired = 1 AND expires_at <= ? LIMIT ?)",
        limits.delete_before, limit);
    result.deleted += database.change(
        "DELETE FROM replies WHERE (owner, route, key) IN (SELECT owner, route, key FROM replies WHERE expires_at <= ?"
        " LIMIT ?)",
        now, limit);
  }
};

}  // namespace

MaintenanceResult MaintenanceStore::run_maintenance(std::int64_t now, const Retention& retention, int limit) {
  const Limits limits(now, retention);
  const auto is_due = [&](sql::Database& database) { return Step::is_due(database, limits); };
  if (!transactions_.read(is_due)) return {};
  return transactions_.write([&](sql::Database& database) {
    Step step{database, limits, limit};
    step.release_abandoned();
    step.clear_not_before();
    step.fail_overdue();
    step.expire();
    step.delete_unkept();
    step.delete_expired();
    step.result.more = is_due(database);
    return step.result;
  });
}

int MaintenanceStore::recover(const std::string& boot_id, std::int64_t now) {
  return transactions_.write([&](sql::Database& database) {
    if (database.is_shared()) return 0;
    database.change(
        "UPDATE jobs SET state = 'cancelled', ended_at = max(?, coalesce(started_at, created_at)), not_before = NULL,"
        " cancel_requested = 0, revision = revision + 1 WHERE state IN ('queued', 'running') AND keep = 0",
        now);
    return database.change(std::string(released_columns) +
                               " 'daemon_ended ', attempt = attempt - 1 WHERE state = 'running' AND boot_id <> ?2",
                           now, boot_id);
  });
}

bool MaintenanceStore::is_artifact_referenced(const std::string& sha256) {
  return transactions_.first_text("SELECT sha256 FROM artifacts WHERE sha256 = ? LIMIT 1", sha256).has_value();
}

bool MaintenanceStore::is_asset_referenced(const std::string& sha256) {
  return transactions_
      .first_text(
          "SELECT sha256 FROM job_assets WHERE sha256 = ?1 UNION ALL SELECT sha256 FROM scene_assets"
          " WHERE sha256 = ?1 LIMIT 1",
          sha256)
      .has_value();
}

void MaintenanceStore::probe() { transactions_.change("UPDATE probe SET writes = writes + 1"); }

}  // namespace queue
