/// Rows of jobs. Reads have connections of their own, so that writes do not delay them.

#include <cassert>

#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/job_moves.h"
#include "server/storage/sqlite/job_rows.h"
#include "server/storage/sqlite/list_query.h"

namespace storage::sqlite {
namespace {

class SqliteJobStore final : public queue::JobStore {
 public:
  explicit SqliteJobStore(Connections& connections) : connections_(connections) {}

  queue::InsertResult insert(const queue::InsertRequest& request, std::int64_t now) override {
    const auto work = [&](Database& database) {
      queue::InsertResult result;
      if (request.reply) {
        result.earlier = read_reply(database, request.reply->key, now);
        if (result.earlier) return result;
        insert_reply(database, *request.reply);
      }
      if (request.batch) insert_batch(database, *request.batch);
      for (const auto& [job, document] : request.jobs) {
        assert(job.state == queue::JobState::queued || job.state == queue::JobState::succeeded);
        insert_job(database, job, document);
      }
      if (request.claim) result.claim = claim_if_alone(database, request.jobs.front().job.id, *request.claim, now);
      return result;
    };
    return connections_.writer.run(work, synced(request.durable));
  }

  std::optional<queue::KeptReply> find_reply(const queue::ReplyKey& key, std::int64_t now) override {
    return connections_.reader.run([&](Database& database) { return read_reply(database, key, now); });
  }

  std::optional<queue::Job> find(const std::string& id) override {
    return connections_.reader.run([&](Database& database) { return read_job(database, id); });
  }

  std::optional<queue::Job> find_by_content_key(const std::string& content_key, std::int64_t expires_after) override {
    return connections_.reader.run([&](Database& database) -> std::optional<queue::Job> {
      Query newest = database.query(
          "SELECT id FROM jobs INDEXED BY jobs_by_content WHERE content_key = ? AND state = 'succeeded' AND expired = 0"
          " AND (expires_at IS NULL OR expires_at > ?) ORDER BY id DESC LIMIT 1",
          content_key, expires_after);
      if (!newest.row()) return std::nullopt;
      return read_job(database, newest.text(0));
    });
  }

  std::optional<std::string> document(const std::string& id) override {
    return connections_.reader.run([&](Database& database) { return read_document(database, id); });
  }

  queue::JobPage list(const queue::JobFilter& filter, const std::string& cursor, int limit) override {
    return connections_.reader.run([&](Database& database) {
      std::vector<std::string> ids = list_ids(database, filter, cursor, limit + 1);
      queue::JobPage page;
      if (ids.size() > static_cast<std::size_t>(limit)) {
        ids.pop_back();
        page.next_cursor = ids.back();
      }
      for (const std::string& id : ids) page.items.push_back(read_job(database, id).value());
      return page;
    });
  }

  queue::ChangeOutcome change(const std::string& id, const queue::JobChange& change,
                              std::optional<std::int64_t> revision) override {
    using Outcome = queue::ChangeOutcome;
    return connections_.writer.run([&](Database& database) {
      const std::optional<queue::Job> job = read_job(database, id);
      if (!job) return Outcome::unknown;
      if (revision && *revision != job->revision) return Outcome::other_revision;
      if (change.priority && queue::ended(job->state)) return Outcome::ended;
      if (change.expires_at && job->expired) return Outcome::expired;
      const int priority = change.priority.value_or(job->priority);
      const std::int64_t rank_change = queue::rank_of(0, {}, priority) - queue::rank_of(0, {}, job->priority);
      database.change(
          "UPDATE jobs SET name = ?, priority = ?, rank = rank + ?, expires_at = ?, revision = revision + 1"
          " WHERE id = ?",
          change.name.value_or(job->name), std::int64_t{priority}, rank_change,
          change.expires_at ? *change.expires_at : job->expires_at, id);
      if (change.labels) {
        database.change("DELETE FROM labels WHERE job_id = ?", id);
        insert_labels(database, id, *change.labels);
      }
      return Outcome::changed;
    });
  }

  queue::Removal remove(const std::string& id) override {
    using Outcome = queue::RemoveOutcome;
    return connections_.writer.run([&](Database& database) -> queue::Removal {
      queue::Removal removal{Outcome::removed, read_artifacts(database, id)};
      if (database.change("DELETE FROM jobs WHERE id = ? AND state <> 'running'", id) == 1) return removal;
      const bool running = database.query("SELECT 1 FROM jobs WHERE id = ?", id).row();
      return {running ? Outcome::running : Outcome::unknown, {}};
    });
  }

 private:
  Connections& connections_;
};

}  // namespace

std::unique_ptr<queue::JobStore> make_job_store(Connections& connections) {
  return std::make_unique<SqliteJobStore>(connections);
}

}  // namespace storage::sqlite
