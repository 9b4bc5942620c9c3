#include "server/storage/postgres/postgres_task_store.h"

#include <utility>

namespace storage::postgres {

const char* const tasks_tables = R"sql(
CREATE UNLOGGED TABLE tasks (
  job_id TEXT COLLATE "C" NOT NULL REFERENCES jobs ON DELETE CASCADE,
  key TEXT COLLATE "C" NOT NULL,
  position BIGINT GENERATED ALWAYS AS IDENTITY,
  build TEXT COLLATE "C" NOT NULL,
  coordinator TEXT COLLATE "C" NOT NULL,  -- the node that runs the job
  state TEXT COLLATE "C" NOT NULL DEFAULT 'waiting' CHECK (state IN ('waiting', 'claimed', 'done')),
  node TEXT COLLATE "C" NOT NULL DEFAULT '',
  attempt BIGINT NOT NULL DEFAULT 0,
  lease_until BIGINT NOT NULL DEFAULT 0,  -- milliseconds of the server's clock
  part BYTEA NOT NULL,                    -- empty once it is done
  result BYTEA,
  PRIMARY KEY (job_id, key)
);
ALTER TABLE tasks ALTER COLUMN part SET STORAGE EXTERNAL;
ALTER TABLE tasks ALTER COLUMN result SET STORAGE EXTERNAL;
CREATE INDEX tasks_open ON tasks (position) WHERE state <> 'done';
CREATE UNLOGGED TABLE task_helpers (
  node TEXT COLLATE "C" NOT NULL PRIMARY KEY,
  build TEXT COLLATE "C" NOT NULL,
  seen_at BIGINT NOT NULL
);
CREATE FUNCTION clock_ms() RETURNS BIGINT LANGUAGE sql VOLATILE
  RETURN CAST(extract(epoch FROM clock_timestamp()) * 1000 AS BIGINT);
CREATE FUNCTION tasks_of_job_ended() RETURNS TRIGGER LANGUAGE plpgsql AS $$
BEGIN
  DELETE FROM tasks WHERE job_id = new.id;
  RETURN NULL;
END $$;
CREATE TRIGGER tasks_of_job_ended AFTER UPDATE OF state ON jobs FOR EACH ROW
  WHEN (new.state IN ('succeeded', 'failed', 'cancelled')) EXECUTE FUNCTION tasks_of_job_ended();
)sql";

namespace {

constexpr std::int64_t lease_ms = 5000, help_ms = 5000;

/// Each call is one transaction that power loss may undo.
class PostgresTaskStore final : public queue::TaskStore {
  template <class Work>
  auto write(const Work& work) {
    return transactions_.write(work, sql::Synced::with_next);
  }

 public:
  PostgresTaskStore(sql::Transactions& transactions, std::string node, std::string build)
      : transactions_(transactions), node_(std::move(node)), build_(std::move(build)) {}

  void publish(const std::string& job_id, const std::vector<queue::NewTask>& tasks) override {
    write([&](sql::Database& database) {
      for (const queue::NewTask& task : tasks)
        database.post(
            "INSERT INTO tasks (job_id, key, build, coordinator, part) VALUES (?1, ?2, ?3, ?4, ?5)"
            " ON CONFLICT (job_id, key) DO UPDATE SET coordinator = excluded.coordinator,"
            " state = CASE WHEN tasks.state = 'claimed' AND tasks.node = excluded.coordinator THEN 'waiting'"
            " ELSE tasks.state END",
            job_id, task.key, build_, node_, sql::Blob{task.part});
      return true;
    });
  }

  std::optional<queue::TaskClaim> claim_own(const std::string& job_id) override {
    return claim("job_id = ?3", "position", job_id);
  }

  std::optional<queue::TaskClaim> claim_other(const std::string& excluded) override {
    return claim(
        "coordinator <> ?1 AND strpos(?3, job_id) = 0 AND build = ?4"
        " AND EXISTS (SELECT 1 FROM jobs WHERE id = job_id AND jobs.state = 'running')",
        "position DESC", excluded, build_);
  }

  void renew() override {
    write([&](sql::Database& database) {
      return database.change("UPDATE tasks SET lease_until = clock_ms() + ?2 WHERE state = 'claimed' AND node = ?1",
                             node_, lease_ms);
    });
  }

  bool finish(const queue::TaskClaim& claimed, const std::string& result) override {
    return write([&](sql::Database& database) {
      return database.change(
                 "UPDATE tasks SET state = 'done', result = ?4, part = ''"
                 " WHERE job_id = ?1 AND key = ?2 AND attempt = ?3 AND state = 'claimed'",
                 claimed.job_id, claimed.key, claimed.attempt, sql::Blob{result}) > 0;
    });
  }

  void release(const queue::TaskClaim& claimed) override {
    write([&](sql::Database& database) {
      return database.change(
          "UPDATE tasks SET state = 'waiting' WHERE job_id = ?1 AND key = ?2 AND attempt = ?3 AND state = 'claimed'",
          claimed.job_id, claimed.key, claimed.attempt);
    });
  }

  std::vector<std::string> finished(const std::string& job_id) override {
    return transactions_.read([&](sql::Database& database) {
      return database.query("SELECT key FROM tasks WHERE job_id = ?1 AND state = 'done'", job_id).texts();
    });
  }

  std::optional<queue::TaskOutcome> outcome(const std::string& job_id, const std::string& key) override {
    return transactions_.read([&](sql::Database& database) -> std::optional<queue::TaskOutcome> {
      sql::Query found = database.query(
          "SELECT node, attempt, result FROM tasks WHERE job_id = ?1 AND key = ?2 AND state = 'done'", job_id, key);
      if (!found.row()) return std::nullopt;
      return queue::TaskOutcome{found.text(0), found.integer(1), found.text(2)};
    });
  }

  void offer_help() override {
    write([&](sql::Database& database) {
      return database.change(
          "INSERT INTO task_helpers VALUES (?1, ?2, clock_ms())"
          " ON CONFLICT (node) DO UPDATE SET seen_at = excluded.seen_at",
          node_, build_);
    });
  }

  int helpers() override {
    return write([&](sql::Database& database) {
      database.change("DELETE FROM task_helpers WHERE seen_at < clock_ms() - ?1", std::int64_t{60} * 1000);
      sql::Query count = database.query(
          "SELECT count(*) FROM task_helpers WHERE node <> ?1 AND build = ?2 AND seen_at > clock_ms() - ?3", node_,
          build_, help_ms);
      return count.row() ? static_cast<int>(count.integer(0)) : 0;
    });
  }

 private:
  template <class... Values>
  std::optional<queue::TaskClaim> claim(const std::string& condition, const std::string& order,
                                        const Values&... values) {
    return write([&](sql::Database& database) -> std::optional<queue::TaskClaim> {
      sql::Query claimed = database.query(
          "UPDATE tasks SET state = 'claimed', node = ?1, attempt = attempt + 1, lease_until = clock_ms() + ?2"
          " WHERE (job_id, key) = (SELECT job_id, key FROM tasks WHERE " +
              condition + " AND (state = 'waiting' OR state = 'claimed' AND lease_until < clock_ms()) ORDER BY " +
              order + " LIMIT 1 FOR UPDATE SKIP LOCKED) RETURNING job_id, key, attempt, part",
          node_, lease_ms, values...);
      if (!claimed.row()) return std::nullopt;
      return queue::TaskClaim{claimed.text(0), claimed.text(1), claimed.integer(2), claimed.text(3)};
    });
  }

  sql::Transactions& transactions_;
  const std::string node_, build_;
};

}  // namespace

std::unique_ptr<queue::TaskStore> make_task_store(sql::Transactions& transactions, const std::string& node,
                                                  const std::string& build) {
  return std::make_unique<PostgresTaskStore>(transactions, node, build);
}

}  // namespace storage::postgres
