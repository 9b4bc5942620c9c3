#include "server/storage/sqlite/batch_rows.h"

namespace storage::sqlite {

void insert_batch(Database& database, const queue::Batch& batch) {
  std::optional<std::int64_t> max_failed;
  if (batch.max_failed) max_failed = *batch.max_failed;
  database.change("INSERT INTO batches (id, owner, name, created_at, max_failed, size) VALUES (?, ?, ?, ?, ?, ?)",
                  batch.id, batch.owner, batch.name, batch.created_at, max_failed, std::int64_t{batch.size});
}

std::optional<queue::BatchState> read_batch(Database& database, const std::string& id) {
  Query row = database.query("SELECT owner, name, created_at, max_failed, size FROM batches WHERE id = ?", id);
  if (!row.row()) return std::nullopt;
  queue::BatchState state{{id, row.text(0), row.text(1), row.integer(2), {}, static_cast<int>(row.integer(4))}, {}};
  if (const auto max_failed = row.optional_integer(3)) state.batch.max_failed = static_cast<int>(*max_failed);
  Query counts =
      database.query("SELECT state, count(*) FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? GROUP BY state", id);
  while (counts.row()) state.jobs.emplace(queue::job_state(counts.text(0)).value(), counts.integer(1));
  return state;
}

}  // namespace storage::sqlite
