/// Counts over all jobs, from tables that triggers maintain.

#include <algorithm>

#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/list_query.h"

namespace storage::sqlite {
namespace {

class SqliteStatistics final : public queue::JobStatistics {
 public:
  explicit SqliteStatistics(Connections& connections) : connections_(connections) {}

  std::int64_t count(queue::JobState state) override {
    return connections_.reader.run([&](Database& database) { return count_jobs(database, state); });
  }

  queue::OwnerUsage owner_usage(const std::string& owner) override {
    return connections_.reader.run([&](Database& database) {
      Query row = database.query("SELECT queued_jobs, artifact_bytes FROM owner_usage WHERE owner = ?", owner);
      return row.row() ? queue::OwnerUsage{row.integer(0), row.integer(1)} : queue::OwnerUsage{};
    });
  }

  queue::QueueDepth depth() override {
    return connections_.reader.run([&](Database& database) {
      queue::QueueDepth depth;
      Query queued = database.query("SELECT priority, jobs FROM queued_by_priority WHERE jobs > 0");
      while (queued.row()) depth.queued_by_priority.emplace(static_cast<int>(queued.integer(0)), queued.integer(1));
      Query delayed = database.query("SELECT count(*) FROM jobs INDEXED BY jobs_delayed WHERE not_before IS NOT NULL");
      delayed.row();
      depth.delayed = delayed.integer(0);
      // Ids are in order of creation.
      Query oldest = database.query(
          "SELECT max(created_at, coalesce(run_after, created_at)) FROM jobs INDEXED BY jobs_by_state"
          " WHERE state = 'queued' AND not_before IS NULL ORDER BY id LIMIT 1");
      if (oldest.row()) depth.oldest_at = oldest.integer(0);
      return depth;
    });
  }

  std::optional<std::int64_t> queue_position(const std::string& id, std::int64_t limit) override {
    return connections_.reader.run([&](Database& database) -> std::optional<std::int64_t> {
      Query job =
          database.query("SELECT suspect, rank FROM jobs WHERE id = ? AND state = 'queued' AND not_before IS NULL", id);
      if (!job.row()) return std::nullopt;
      // Suspects run before all others.
      Query before = database.query(
          "SELECT (SELECT count(*) FROM (SELECT 1 FROM jobs INDEXED BY jobs_waiting WHERE state = 'queued'"
          "   AND not_before IS NULL AND suspect = ?1 AND (rank, id) < (?2, ?3) LIMIT ?4))"
          " + iif(?1, 0, (SELECT count(*) FROM jobs INDEXED BY jobs_waiting WHERE state = 'queued'"
          "   AND not_before IS NULL AND suspect = 1))",
          job.integer(0), job.integer(1), id, limit);
      before.row();
      return std::min(before.integer(0), limit);
    });
  }

 private:
  Connections& connections_;
};

}  // namespace

std::unique_ptr<queue::JobStatistics> make_job_statistics(Connections& connections) {
  return std::make_unique<SqliteStatistics>(connections);
}

}  // namespace storage::sqlite
