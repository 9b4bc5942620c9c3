/// What owners and the housekeeper change: retries, other fields, deadlines, expiry.

#include <cassert>
#include <vector>

#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/job_moves.h"
#include "server/storage/sqlite/job_rows.h"

namespace queue {

using sqlite::Database;
using sqlite::Query;

namespace {

std::vector<std::string> ids_of(Query query) {
  std::vector<std::string> ids;
  while (query.row()) ids.push_back(query.text(0));
  return ids;
}

bool anything_to_do(Database& database, std::int64_t now, std::int64_t delete_before) {
  Query any = database.query(
      "SELECT EXISTS (SELECT 1 FROM jobs INDEXED BY jobs_delayed WHERE not_before <= ?1)"
      " OR EXISTS (SELECT 1 FROM jobs INDEXED BY jobs_by_deadline WHERE state = 'queued' AND deadline <= ?1)"
      " OR EXISTS (SELECT 1 FROM jobs INDEXED BY jobs_leased WHERE state = 'running' AND lease_until <= ?1)"
      " OR EXISTS (SELECT 1 FROM jobs INDEXED BY jobs_expiring"
      "   WHERE ended_at IS NOT NULL AND expired = 0 AND expires_at <= ?1)"
      " OR EXISTS (SELECT 1 FROM jobs INDEXED BY jobs_expired WHERE expired = 1 AND expires_at <= ?2)"
      " OR EXISTS (SELECT 1 FROM replies WHERE expires_at <= ?1)",
      now, delete_before);
  any.row();
  return any.integer(0) != 0;
}

void take_back_abandoned(Database& database, std::int64_t now, std::int64_t limit, MaintenanceResult& upkeep) {
  upkeep.abandoned = ids_of(database.query(
      "SELECT id FROM jobs INDEXED BY jobs_leased WHERE state = 'running' AND lease_until <= ? LIMIT ?", now, limit));
  for (const std::string& id : upkeep.abandoned) {
    database.change(std::string(sqlite::given_back) + " attempt = attempt - 1 WHERE id = ?2", now, id);
  }
}

void let_due_jobs_run(Database& database, std::int64_t now, std::int64_t limit, MaintenanceResult& upkeep) {
  Query due = database.query(
      "SELECT id, suspect FROM jobs INDEXED BY jobs_delayed WHERE not_before <= ? ORDER BY not_before LIMIT ?", now,
      limit);
  std::vector<std::string> ids;
  while (due.row()) {
    ids.push_back(due.text(0));
    upkeep.suspects_due = upkeep.suspects_due || due.integer(1) != 0;
  }
  for (const std::string& id : ids) {
    database.change("UPDATE jobs SET not_before = NULL, revision = revision + 1 WHERE id = ?", id);
  }
  upkeep.due = !ids.empty();
}

void fail_overdue(Database& database, std::int64_t now, std::int64_t limit, MaintenanceResult& upkeep) {
  upkeep.overdue = ids_of(database.query(
      "SELECT id FROM jobs INDEXED BY jobs_by_deadline WHERE state = 'queued' AND deadline <= ? LIMIT ?", now, limit));
  for (const std::string& id : upkeep.overdue) {
    assert(may_move(JobState::queued, JobState::failed));
    database.change(
        "UPDATE jobs SET state = 'failed', ended_at = ?1, not_before = NULL, revision = revision + 1,"
        " expires_at = coalesce(expires_at, ?1 + 1000 * expires_in_s) WHERE id = ?2",
        now, id);
    sqlite::insert_problem(database, id, deadline_exceeded());
  }
}

void expire(Database& database, std::int64_t now, std::int64_t limit, MaintenanceResult& upkeep) {
  const std::vector<std::string> ids =
      ids_of(database.query("SELECT id FROM jobs INDEXED BY jobs_expiring"
                            " WHERE ended_at IS NOT NULL AND expired = 0 AND expires_at <= ? LIMIT ?",
                            now, limit));
  for (const std::string& id : ids) {
    const std::vector<Artifact> artifacts = sqlite::read_artifacts(database, id);
    upkeep.artifacts.insert(upkeep.artifacts.end(), artifacts.begin(), artifacts.end());
    database.change("DELETE FROM artifacts WHERE job_id = ?", id);
    database.change("DELETE FROM documents WHERE job_id = ?", id);
    database.change("UPDATE jobs SET expired = 1, revision = revision + 1 WHERE id = ?", id);
  }
  upkeep.expired = static_cast<int>(ids.size());
}

void forget(Database& database, std::int64_t now, std::int64_t delete_before, std::int64_t limit,
            MaintenanceResult& upkeep) {
  upkeep.forgotten = database.change(
      "DELETE FROM jobs WHERE id IN (SELECT id FROM jobs INDEXED BY jobs_expired"
      " WHERE expired = 1 AND expires_at <= ? LIMIT ?)",
      delete_before, limit);
  upkeep.forgotten += database.change(
      "DELETE FROM replies WHERE (owner, route, key) IN (SELECT owner, route, key FROM replies WHERE expires_at <= ?"
      " LIMIT ?)",
      now, limit);
}

}  // namespace

RetryOutcome SqliteJobStore::retry(const std::string& id, std::int64_t now) {
  return parts_->writer.run([&](Database& database) { return sqlite::retry_job(database, id, now); });
}

ChangeOutcome SqliteJobStore::change(const std::string& id, const JobChange& change,
                                     std::optional<std::int64_t> revision) {
  return parts_->writer.run([&](Database& database) {
    const std::optional<Job> job = sqlite::read_job(database, id);
    if (!job) return ChangeOutcome::unknown;
    if (revision && *revision != job->revision) return ChangeOutcome::other_revision;
    if (change.priority && ended(job->state)) return ChangeOutcome::ended;
    if (change.expires_at && job->expired) return ChangeOutcome::expired;
    const int priority = change.priority.value_or(job->priority);
    const std::int64_t rank_change = rank_of(0, {}, priority) - rank_of(0, {}, job->priority);
    database.change(
        "UPDATE jobs SET name = ?, priority = ?, rank = rank + ?, expires_at = ?, revision = revision + 1 WHERE id = ?",
        change.name.value_or(job->name), std::int64_t{priority}, rank_change,
        change.expires_at ? *change.expires_at : job->expires_at, id);
    if (change.labels) {
      database.change("DELETE FROM labels WHERE job_id = ?", id);
      sqlite::insert_labels(database, id, *change.labels);
    }
    return ChangeOutcome::changed;
  });
}

MaintenanceResult SqliteJobStore::run_maintenance(std::int64_t now, std::int64_t expired_kept_ms, int limit) {
  const std::int64_t delete_before = now - expired_kept_ms;
  const bool anything =
      parts_->reader.run([&](Database& database) { return anything_to_do(database, now, delete_before); });
  if (!anything) return {};
  return parts_->writer.run([&](Database& database) {
    MaintenanceResult step;
    take_back_abandoned(database, now, limit, step);
    let_due_jobs_run(database, now, limit, step);
    fail_overdue(database, now, limit, step);
    expire(database, now, limit, step);
    forget(database, now, delete_before, limit, step);
    step.more = anything_to_do(database, now, delete_before);
    return step;
  });
}

}  // namespace queue
