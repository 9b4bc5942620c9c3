#include "server/queue/job_rows.h"

#include <iterator>
#include <sstream>
#include <tuple>

namespace queue {
namespace {

/// Columns of `jobs` and the members of a job that they hold, in the same order.
constexpr const char* member_columns =
    "id, kind, owner, weight, name, batch_index, variation, state, created_at, started_at, ended_at, attempt,"
    " max_attempts, priority, run_after, not_before, deadline, expires_in_s, expires_at, keep, cancel_requested,"
    " suspect, width, height, formats, accuracy, large, work, artifacts_synced, use_cache, revision";
template <class AnyJob>
auto members(AnyJob& job) {
  return std::tie(job.id, job.kind, job.owner, job.weight, job.name, job.batch_index, job.variation, job.state,
                  job.created_at, job.started_at, job.ended_at, job.attempt, job.max_attempts, job.priority,
                  job.run_after, job.not_before, job.deadline, job.expires_in_s, job.expires_at, job.keep,
                  job.cancel_requested, job.suspect, job.width, job.height, job.formats, job.accuracy, job.large,
                  job.work, job.artifacts_synced, job.use_cache, job.revision);
}

std::optional<std::string> null_if_empty(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

std::vector<tracer::Issue> read_errors(sql::Database& database, const std::string& id) {
  return database.query("SELECT pointer, code, detail FROM problem_errors WHERE job_id = ? ORDER BY position", id)
      .all([](const sql::Query& row) {
        return tracer::Issue{row.text(0), row.text(1), row.text(2)};
      });
}

constexpr const char* summary_columns = "kind, name, batch_id, owner, keep, state";

/// None without a row of the summary's columns.
std::optional<JobSummary> take_summary(const std::string& id, sql::Query row) {
  if (!row.row()) return std::nullopt;
  JobSummary job;
  job.id = id;
  row.take(job.kind, job.name, job.batch, job.owner, job.keep, job.state);
  return job;
}

}  // namespace

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : " ").append(word);
  return text;
}

std::vector<std::string> split(const std::string& text) {
  std::istringstream words(text);
  return {std::istream_iterator<std::string>(words), std::istream_iterator<std::string>()};
}

void insert_labels(sql::Database& database, const std::string& id, const std::map<std::string, std::string>& labels) {
  for (const auto& [key, value] : labels) {
    database.post("INSERT INTO labels (key, value, job_id) VALUES (?, ?, ?)", key, value, id);
  }
}

void insert_job(sql::Database& database, const Job& job, const std::string& document,
                const std::optional<std::string>& scene_id) {
  std::optional<std::string> url, events;
  if (job.webhook) url = job.webhook->url, events = joined(job.webhook->events);
  static const std::string insert =
      std::string("INSERT INTO jobs (rank, moved_at, batch_id, webhook_url, webhook_events, content_key, ") +
      member_columns + ") VALUES (" + sql::marks(6 + std::tuple_size_v<decltype(members(job))>) + ")";
  const auto post = [&](const auto&... member) {
    database.post(insert, rank_of(job.created_at, job.run_after, job.priority), job.started_at.value_or(job.created_at),
                  null_if_empty(job.batch), url, events, null_if_empty(job.content_key), member...);
  };
  std::apply(post, members(job));
  database.post("INSERT INTO documents (job_id, document, scene_id) VALUES (?, ?, ?)", job.id, sql::Blob{document},
                scene_id);
  insert_labels(database, job.id, job.labels);
  std::int64_t position = 0;
  for (const std::string& sha256 : job.assets) {
    database.post("INSERT INTO job_assets (job_id, position, sha256) VALUES (?, ?, ?)", job.id, position++, sha256);
  }
  if (job.state != JobState::succeeded) return;
  insert_report(database, job.id, job.report);
  insert_artifacts(database, job.id, job.artifacts);
}

void insert_report(sql::Database& database, const std::string& id, const std::string& report) {
  database.post("INSERT INTO reports (job_id, report) VALUES (?, ?)", id, report);
}

void insert_problem(sql::Database& database, const std::string& id, const Problem& problem) {
  database.post("UPDATE jobs SET problem_code = ?, problem_detail = ? WHERE id = ?", problem.code, problem.detail, id);
  database.post("UPDATE moves SET reason = ? WHERE (job_id, revision) = (SELECT id, revision FROM jobs WHERE id = ?)",
                problem.code + " " + problem.detail, id);
  std::int64_t position = 0;
  for (const tracer::Issue& error : problem.errors) {
    database.post("INSERT INTO problem_errors (job_id, position, pointer, code, detail) VALUES (?, ?, ?, ?, ?)", id,
                  position++, error.pointer, error.code, error.detail);
  }
}

void insert_artifacts(sql::Database& database, const std::string& id, const std::vector<Artifact>& artifacts) {
  std::int64_t position = 0;
  for (const Artifact& artifact : artifacts) {
    database.post(
        "INSERT INTO artifacts (job_id, position, name, media_type, sha256, bytes, owner)"
        " SELECT id, ?, ?, ?, ?, ?, owner FROM jobs WHERE id = ?",
        position++, artifact.name, artifact.media_type, artifact.sha256, artifact.bytes, id);
  }
}

void lock_job(sql::Database& database, const std::string& id) {
  if (database.is_shared())
    database.query("SELECT 1 FROM jobs WHERE id = ?" + std::string(database.locking()), id).row();
}

std::optional<Job> read_job(sql::Database& database, const std::string& id) {
  static const std::string select = std::string("SELECT ") + member_columns +
                                    ", expired, content_key, batch_id, webhook_url, webhook_events, problem_code,"
                                    " problem_detail FROM jobs WHERE id = ?";
  sql::Query row = database.query(select, id);
  if (!row.row()) return std::nullopt;
  Job job;
  std::optional<std::string> url, code;
  std::string events, detail;
  std::apply([&](auto&... member) { row.take(member...); }, members(job));
  row.take(job.expired, job.content_key, job.batch, url, events, code, detail);
  if (url) job.webhook = api::Webhook{*url, split(events)};
  if (code) job.problem = Problem{*code, detail, read_errors(database, id)};
  sql::Query labels = database.query("SELECT key, value FROM labels WHERE job_id = ?", id);
  while (labels.row()) job.labels.emplace(labels.text(0), labels.text(1));
  job.assets = database.texts("SELECT sha256 FROM job_assets WHERE job_id = ? ORDER BY position", id);
  if (job.state == JobState::succeeded)
    job.report = database.first_text("SELECT report FROM reports WHERE job_id = ?", id).value_or("");
  if (ended(job.state)) job.artifacts = read_artifacts(database, id);
  return job;
}

std::optional<JobSummary> read_summary(sql::Database& database, const std::string& id) {
  return take_summary(id, database.query("SELECT " + std::string(summary_columns) + " FROM jobs WHERE id = ?", id));
}

std::optional<JobSummary> delete_job(sql::Database& database, const std::string& id) {
  if (database.is_shared()) {
    database.post("SELECT add_event(jobs, 'removed') FROM jobs WHERE id = ? AND state <> 'running'", id);
  }
  const std::string sql = "DELETE FROM jobs WHERE id = ? AND state <> 'running' RETURNING ";
  return take_summary(id, database.query(sql + summary_columns, id));
}

std::vector<Artifact> read_artifacts(sql::Database& database, const std::string& id) {
  std::vector<Artifact> artifacts;
  sql::Query row =
      database.query("SELECT name, media_type, sha256, bytes FROM artifacts WHERE job_id = ? ORDER BY position", id);
  while (row.row()) {
    Artifact& artifact = artifacts.emplace_back();
    row.take(artifact.name, artifact.media_type, artifact.sha256, artifact.bytes);
  }
  return artifacts;
}

std::int64_t read_artifact_bytes(sql::Database& database) {
  return database.number("SELECT bytes FROM artifact_total");
}

}  // namespace queue
