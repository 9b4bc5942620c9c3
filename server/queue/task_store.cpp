#include "server/queue/task_store.h"

namespace queue {
namespace {

constexpr std::int64_t lease_ms = 5000, help_ms = 5000;

}  // namespace

/// Each call is one transaction that power loss may undo.
template <class Work>
auto TaskStore::write(const Work& work) {
  return transactions_.write(work, sql::Synced::with_next);
}

template <class... Values>
std::optional<TaskClaim> TaskStore::claim(const std::string& condition, const std::string& order,
                                          const Values&... values) {
  return write([&](sql::Database& database) -> std::optional<TaskClaim> {
    sql::Query claimed = database.query(
        "UPDATE tasks SET state = 'claimed', node = ?1, attempt = attempt + 1, lease_until = clock_ms() + ?2"
        " WHERE (job_id, key) = (SELECT job_id, key FROM tasks WHERE " +
            condition + " AND (state = 'waiting' OR state = 'claimed' AND lease_until < clock_ms()) ORDER BY " + order +
            " LIMIT 1 FOR UPDATE SKIP LOCKED) RETURNING job_id, key, attempt, part",
        node_, lease_ms, values...);
    if (!claimed.row()) return std::nullopt;
    TaskClaim task;
    claimed.take(task.job_id, task.key, task.attempt, task.part);
    return task;
  });
}

void TaskStore::publish(const std::string& job_id, const std::vector<NewTask>& tasks) {
  write([&](sql::Database& database) {
    for (const NewTask& task : tasks)
      database.post(
          "INSERT INTO tasks (job_id, key, build, coordinator, part) VALUES (?1, ?2, ?3, ?4, ?5)"
          " ON CONFLICT (job_id, key) DO UPDATE SET coordinator = excluded.coordinator,"
          " state = CASE WHEN tasks.state = 'claimed' AND tasks.node = excluded.coordinator THEN 'waiting'"
          " ELSE tasks.state END",
          job_id, task.key, build_, node_, sql::Blob{task.part});
    return true;
  });
}

std::optional<TaskClaim> TaskStore::claim_own(const std::string& job_id) {
  return claim("job_id = ?3", "position", job_id);
}

std::optional<TaskClaim> TaskStore::claim_other(const std::string& excluded) {
  return claim(
      "coordinator <> ?1 AND strpos(?3, job_id) = 0 AND build = ?4"
      " AND EXISTS (SELECT 1 FROM jobs WHERE id = job_id AND jobs.state = 'running')",
      "position DESC", excluded, build_);
}

void TaskStore::renew() {
  transactions_.change(sql::Synced::with_next,
                       "UPDATE tasks SET lease_until = clock_ms() + ?2 WHERE state = 'claimed' AND node = ?1", node_,
                       lease_ms);
}

bool TaskStore::finish(const TaskClaim& claimed, const std::string& result) {
  return transactions_.change(sql::Synced::with_next,
                              "UPDATE tasks SET state = 'done', result = ?4, part = ''"
                              " WHERE job_id = ?1 AND key = ?2 AND attempt = ?3 AND state = 'claimed'",
                              claimed.job_id, claimed.key, claimed.attempt, sql::Blob{result}) > 0;
}

void TaskStore::release(const TaskClaim& claimed) {
  transactions_.change(
      sql::Synced::with_next,
      "UPDATE tasks SET state = 'waiting' WHERE job_id = ?1 AND key = ?2 AND attempt = ?3 AND state = 'claimed'",
      claimed.job_id, claimed.key, claimed.attempt);
}

std::vector<std::string> TaskStore::finished(const std::string& job_id) {
  return transactions_.texts("SELECT key FROM tasks WHERE job_id = ?1 AND state = 'done'", job_id);
}

std::optional<TaskOutcome> TaskStore::outcome(const std::string& job_id, const std::string& key) {
  return transactions_.read([&](sql::Database& database) -> std::optional<TaskOutcome> {
    sql::Query found = database.query(
        "SELECT node, attempt, result FROM tasks WHERE job_id = ?1 AND key = ?2 AND state = 'done'", job_id, key);
    if (!found.row()) return std::nullopt;
    return TaskOutcome{found.text(0), found.integer(1), found.text(2)};
  });
}

void TaskStore::register_helper() {
  transactions_.change(sql::Synced::with_next,
                       "INSERT INTO task_helpers VALUES (?1, ?2, clock_ms())"
                       " ON CONFLICT (node) DO UPDATE SET seen_at = excluded.seen_at",
                       node_, build_);
}

int TaskStore::helpers() {
  return write([&](sql::Database& database) {
    database.change("DELETE FROM task_helpers WHERE seen_at < clock_ms() - ?1", 60 * 1000);
    return static_cast<int>(database.number(
        "SELECT count(*) FROM task_helpers WHERE node <> ?1 AND build = ?2 AND seen_at > clock_ms() - ?3", node_,
        build_, help_ms));
  });
}

}  // namespace queue
