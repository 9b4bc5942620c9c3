/// Jobs that were submitted together.

#include <vector>

#include "server/storage/sqlite/batch_rows.h"
#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/job_moves.h"

namespace queue {

using sqlite::Database;
using sqlite::Query;

namespace {

std::vector<std::string> ids_of_batch(Database& database, const std::string& id) {
  std::vector<std::string> ids;
  Query jobs = database.query("SELECT id FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? ORDER BY id", id);
  while (jobs.row()) ids.push_back(jobs.text(0));
  return ids;
}

}  // namespace

std::optional<BatchState> SqliteJobStore::find_batch(const std::string& id) {
  return parts_->reader.run([&](Database& database) { return sqlite::read_batch(database, id); });
}

BatchCancel SqliteJobStore::cancel_batch(const std::string& id, std::int64_t now) {
  return parts_->writer.run([&](Database& database) {
    BatchCancel changed;
    for (const std::string& job : ids_of_batch(database, id)) {
      const CancelOutcome outcome = sqlite::cancel_job(database, job, now);
      if (outcome == CancelOutcome::cancelled) changed.cancelled.push_back(job);
      if (outcome == CancelOutcome::cancelling) changed.cancelling.push_back(job);
    }
    return changed;
  });
}

BatchRetry SqliteJobStore::retry_batch(const std::string& id, std::int64_t now) {
  return parts_->writer.run([&](Database& database) {
    BatchRetry retried;
    for (const std::string& job : ids_of_batch(database, id)) {
      if (sqlite::retry_job(database, job, now) == RetryOutcome::queued) retried.jobs.push_back(job);
    }
    retried.suspects = database
                           .query(
                               "SELECT 1 FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? AND suspect = 1"
                               " AND state = 'queued' LIMIT 1",
                               id)
                           .row();
    return retried;
  });
}

std::vector<std::string> SqliteJobStore::failing_batches() {
  return parts_->reader.run([&](Database& database) {
    std::vector<std::string> ids;
    Query failing = database.query(
        "SELECT id FROM batches WHERE max_failed IS NOT NULL AND max_failed <"
        " (SELECT count(*) FROM jobs WHERE batch_id = batches.id AND state = 'failed')"
        " AND EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id AND state IN ('queued', 'running'))");
    while (failing.row()) ids.push_back(failing.text(0));
    return ids;
  });
}

}  // namespace queue
