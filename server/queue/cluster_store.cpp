#include "server/queue/cluster_store.h"

#include <chrono>

#include "server/queue/job_rows.h"

namespace queue {
namespace {

constexpr std::int64_t node_kept_ms = 3'600'000, node_runs_ms = 10'000, result_kept_ms = 600'000;

std::int64_t steady_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

JobEvent read_event(sql::Query& row) {
  JobEvent event;
  JobSummary& job = event.job;
  row.take(event.number, event.at, event.state, job.id, job.kind, job.name, job.batch, job.owner, job.keep);
  const std::optional<JobState> state = job_state(event.state);
  event.kind = state && !ended(*state) ? JobEvent::Kind::state : JobEvent::Kind::done;
  event.progress = state == JobState::succeeded ? 1 : 0;
  job.state = state.value_or(JobState::cancelled);
  return event;
}

}  // namespace

std::optional<int> ClusterStore::number_events() {
  const auto work = [](sql::Database& database) { return static_cast<int>(database.number("SELECT number_events()")); };
  const int count = transactions_.write(work, sql::Synced::with_next);  // it syncs what it has numbered
  return count < 0 ? std::nullopt : std::optional(count);
}

ClusterStore::EventRange ClusterStore::event_range() {
  return transactions_.read([](sql::Database& database) {
    sql::Query row = database.query("SELECT deleted + 1, number FROM numbered");
    row.row();
    return EventRange{row.integer(0), row.integer(1)};
  });
}

std::vector<JobEvent> ClusterStore::events_after(std::int64_t after, int limit) {
  return transactions_.read([&](sql::Database& database) {
    sql::Query rows = database.query(
        "SELECT number, at, state, job_id, kind, name, batch_id, owner, keep FROM events WHERE number > ?"
        " ORDER BY number LIMIT ?",
        after, limit);
    return rows.all(read_event);
  });
}

void ClusterStore::put_result(const std::string& job_id, const std::string& name, const std::string& bytes) {
  const auto work = [&, now = now()](sql::Database& database) {
    database.post("DELETE FROM running_results WHERE at < ?", now - result_kept_ms);
    return database.change(
        "INSERT INTO running_results (job_id, name, bytes, at) VALUES (?1, ?2, ?3, ?4)"
        " ON CONFLICT (job_id, name) DO UPDATE SET bytes = ?3, at = ?4",
        job_id, name, sql::Blob{bytes}, now);
  };
  transactions_.write(work, sql::Synced::with_next);
}

std::optional<std::string> ClusterStore::find_result(const std::string& job_id, const std::string& name) {
  return transactions_.first_text("SELECT bytes FROM running_results WHERE job_id = ? AND name = ?", job_id, name);
}

ClusterStore::Duties ClusterStore::report_node(const Node& node) {
  synchronize();
  const std::int64_t now = ClusterStore::now();
  const auto work = [&](sql::Database& database) {
    database.post(
        "INSERT INTO nodes (id, name, role, version, slots, running, started_at, seen_at)"
        " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)"
        " ON CONFLICT (id) DO UPDATE SET slots = ?5, running = ?6, seen_at = ?8",
        node.id, node.name, node.role, node.version, node.slots, node.running, node.started_at, now);
    database.post("DELETE FROM nodes WHERE seen_at < ?", now - node_kept_ms);
    Duties duties;
    duties.cancelled =
        database.texts("SELECT id FROM jobs WHERE boot_id = ? AND state = 'running' AND cancel_requested = 1", node.id);
    sql::Query row = database.query(
        "SELECT EXISTS (SELECT FROM jobs WHERE suspect = 1 AND state = 'queued' AND not_before IS NULL)::int,"
        " (SELECT count(*) FROM nodes WHERE seen_at > ?)",
        now - node_runs_ms);
    row.row();
    row.take(duties.suspects_wait, duties.nodes);
    return duties;
  };
  return transactions_.write(work, sql::Synced::with_next);
}

void ClusterStore::remove_node(const std::string& id) {
  transactions_.change(sql::Synced::with_next, "DELETE FROM nodes WHERE id = ?", id);
}

std::vector<Node> ClusterStore::nodes() {
  return transactions_.read([](sql::Database& database) {
    std::vector<Node> nodes;
    sql::Query row = database.query(
        "SELECT id, name, role, version, slots, running, started_at, seen_at FROM nodes ORDER BY name, id");
    while (row.row()) {
      Node& node = nodes.emplace_back();
      row.take(node.id, node.name, node.role, node.version, node.slots, node.running, node.started_at, node.seen_at);
    }
    return nodes;
  });
}

void ClusterStore::synchronize() {
  transactions_.read([&](sql::Database& database) {
    // The first statement also begins the transaction and may be prepared; the second one is a bare round trip.
    const std::string statement = "SELECT CAST(extract(epoch FROM clock_timestamp()) * 1000000 AS BIGINT)";
    database.query(statement).row();
    const std::int64_t sent = steady_us();
    const std::int64_t now = database.number(statement);
    ahead_us_ = now - (sent + steady_us()) / 2;
    return 0;
  });
}

std::int64_t ClusterStore::now() const { return (steady_us() + ahead_us_) / 1000; }

}  // namespace queue
