/// Jobs that were submitted together.

#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/job_moves.h"
#include "server/storage/sqlite/job_rows.h"

namespace storage::sqlite {
namespace {

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

std::unique_ptr<queue::BatchStore> make_batch_store(Connections& connections) {
  return std::make_unique<SqliteBatches>(connections);
}

}  // namespace storage::sqlite
