/// What is read of jobs, from connections of its own: writes do not hold it up.

#include <algorithm>

#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/job_rows.h"
#include "server/storage/sqlite/list_query.h"
#include "server/storage/sqlite/reply_rows.h"

namespace queue {

using sqlite::Database;
using sqlite::Query;

std::optional<Job> SqliteJobStore::find(const std::string& id) {
  return parts_->reader.run([&](Database& database) { return sqlite::read_job(database, id); });
}

std::optional<std::string> SqliteJobStore::document(const std::string& id) {
  return parts_->reader.run([&](Database& database) -> std::optional<std::string> {
    Query query = database.query("SELECT document FROM documents WHERE job_id = ?", id);
    if (!query.row()) return std::nullopt;
    return query.text(0);
  });
}

JobPage SqliteJobStore::list(const JobFilter& filter, const std::string& cursor, int limit) {
  return parts_->reader.run([&](Database& database) {
    std::vector<std::string> ids = sqlite::list_ids(database, filter, cursor, limit + 1);
    JobPage page;
    if (ids.size() > static_cast<std::size_t>(limit)) {
      ids.pop_back();
      page.next_cursor = ids.back();
    }
    for (const std::string& id : ids) page.items.push_back(sqlite::read_job(database, id).value());
    return page;
  });
}

std::int64_t SqliteJobStore::count(JobState state) {
  return parts_->reader.run([&](Database& database) { return sqlite::count_jobs(database, state); });
}

bool SqliteJobStore::is_asset_referenced(const std::string& sha256) {
  return parts_->reader.run([&](Database& database) {
    return database.query("SELECT 1 FROM job_assets WHERE sha256 = ? LIMIT 1", sha256).row();
  });
}

bool SqliteJobStore::references(const std::string& sha256) {
  return parts_->reader.run([&](Database& database) {
    return database.query("SELECT 1 FROM artifacts WHERE sha256 = ? LIMIT 1", sha256).row();
  });
}

std::optional<std::string> SqliteJobStore::small_image(const std::string& sha256) {
  return parts_->image_reader.run([&](Database& database) -> std::optional<std::string> {
    Query image = database.query("SELECT bytes FROM small_images WHERE sha256 = ?", sha256);
    if (!image.row()) return std::nullopt;
    return image.text(0);
  });
}

OwnerUse SqliteJobStore::owner_usage(const std::string& owner) {
  return parts_->reader.run([&](Database& database) {
    Query row = database.query("SELECT queued_jobs, artifact_bytes FROM owner_use WHERE owner = ?", owner);
    return row.row() ? OwnerUse{row.integer(0), row.integer(1)} : OwnerUse{};
  });
}

QueueDepth SqliteJobStore::depth() {
  return parts_->reader.run([&](Database& database) {
    QueueDepth depth;
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

std::optional<std::int64_t> SqliteJobStore::queue_position(const std::string& id, std::int64_t limit) {
  return parts_->reader.run([&](Database& database) -> std::optional<std::int64_t> {
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

std::optional<KeptReply> SqliteJobStore::reply(const ReplyKey& key, std::int64_t now) {
  return parts_->reader.run([&](Database& database) { return sqlite::read_reply(database, key, now); });
}

std::optional<Job> SqliteJobStore::find_by_content_key(const std::string& content_key, std::int64_t expires_after) {
  return parts_->reader.run([&](Database& database) -> std::optional<Job> {
    Query newest = database.query(
        "SELECT id FROM jobs INDEXED BY jobs_by_content WHERE content_key = ? AND state = 'succeeded' AND expired = 0"
        " AND (expires_at IS NULL OR expires_at > ?) ORDER BY id DESC LIMIT 1",
        content_key, expires_after);
    if (!newest.row()) return std::nullopt;
    return sqlite::read_job(database, newest.text(0));
  });
}

}  // namespace queue
