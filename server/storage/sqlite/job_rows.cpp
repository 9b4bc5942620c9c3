#include "server/storage/sqlite/job_rows.h"

#include <utility>

namespace jobs::sqlite {
namespace {

std::optional<std::int64_t> optional_integer(const Query& query, int column) {
  if (query.is_null(column)) return std::nullopt;
  return query.integer(column);
}

void read_problem(Database& database, Job& job, const Query& row, int code_column) {
  if (row.is_null(code_column)) return;
  Problem problem{row.text(code_column), row.text(code_column + 1), {}};
  Query errors =
      database.query("SELECT pointer, code, detail FROM problem_errors WHERE job_id = ? ORDER BY position", job.id);
  while (errors.row()) problem.errors.push_back({errors.text(0), errors.text(1), errors.text(2)});
  job.problem = std::move(problem);
}

void read_labels(Database& database, Job& job) {
  Query labels = database.query("SELECT key, value FROM labels WHERE job_id = ?", job.id);
  while (labels.row()) job.labels.emplace(labels.text(0), labels.text(1));
}

void read_report(Database& database, Job& job) {
  Query report = database.query("SELECT report FROM reports WHERE job_id = ?", job.id);
  if (report.row()) job.report = report.text(0);
}

void read_assets(Database& database, Job& job) {
  Query assets = database.query("SELECT sha256 FROM job_assets WHERE job_id = ? ORDER BY position", job.id);
  while (assets.row()) job.assets.push_back(assets.text(0));
}

}  // namespace

void insert_job(Database& database, const Job& job, const std::string& document) {
  database.change(
      "INSERT INTO jobs (id, name, state, created_at, attempt, max_attempts, priority, cancel_requested, suspect,"
      " width, height) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      job.id, job.name, std::string(name_of(job.state)), job.created_at, std::int64_t{job.attempt},
      std::int64_t{job.max_attempts}, std::int64_t{job.priority}, std::int64_t{job.cancel_requested},
      std::int64_t{job.suspect}, std::int64_t{job.width}, std::int64_t{job.height});
  database.change("INSERT INTO documents (job_id, document) VALUES (?, ?)", job.id, Blob{document});
  for (const auto& [key, value] : job.labels) {
    database.change("INSERT INTO labels (key, value, job_id) VALUES (?, ?, ?)", key, value, job.id);
  }
  std::int64_t position = 0;
  for (const std::string& sha256 : job.assets) {
    database.change("INSERT INTO job_assets (job_id, position, sha256) VALUES (?, ?, ?)", job.id, position++, sha256);
  }
}

void insert_problem(Database& database, const std::string& id, const Problem& problem) {
  database.change("UPDATE jobs SET problem_code = ?, problem_detail = ? WHERE id = ?", problem.code, problem.detail,
                  id);
  std::int64_t position = 0;
  for (const tracer::Issue& error : problem.errors) {
    database.change("INSERT INTO problem_errors (job_id, position, pointer, code, detail) VALUES (?, ?, ?, ?, ?)", id,
                    position++, error.pointer, error.code, error.detail);
  }
}

void insert_artifacts(Database& database, const std::string& id, const std::vector<Artifact>& artifacts) {
  std::int64_t position = 0;
  for (const Artifact& artifact : artifacts) {
    database.change(
        "INSERT INTO artifacts (job_id, position, name, media_type, sha256, bytes) VALUES (?, ?, ?, ?, ?, ?)", id,
        position++, artifact.name, artifact.media_type, artifact.sha256, static_cast<std::int64_t>(artifact.bytes));
  }
}

std::optional<Job> read_job(Database& database, const std::string& id) {
  Query row = database.query(
      "SELECT name, state, created_at, started_at, ended_at, attempt, max_attempts, priority, cancel_requested,"
      " suspect, width, height, problem_code, problem_detail FROM jobs WHERE id = ?",
      id);
  if (!row.row()) return std::nullopt;
  Job job;
  job.id = id;
  job.name = row.text(0);
  job.state = job_state(row.text(1)).value();
  job.created_at = row.integer(2);
  job.started_at = optional_integer(row, 3);
  job.ended_at = optional_integer(row, 4);
  job.attempt = static_cast<int>(row.integer(5));
  job.max_attempts = static_cast<int>(row.integer(6));
  job.priority = static_cast<int>(row.integer(7));
  job.cancel_requested = row.integer(8) != 0;
  job.suspect = row.integer(9) != 0;
  job.width = static_cast<std::uint32_t>(row.integer(10));
  job.height = static_cast<std::uint32_t>(row.integer(11));
  read_problem(database, job, row, 12);
  read_labels(database, job);
  read_assets(database, job);
  if (job.state == JobState::succeeded) {
    read_report(database, job);
    job.artifacts = read_artifacts(database, id);
  }
  return job;
}

std::vector<Artifact> read_artifacts(Database& database, const std::string& id) {
  std::vector<Artifact> artifacts;
  Query row =
      database.query("SELECT name, media_type, sha256, bytes FROM artifacts WHERE job_id = ? ORDER BY position", id);
  while (row.row()) {
    artifacts.push_back({row.text(0), row.text(1), row.text(2), static_cast<std::uint64_t>(row.integer(3))});
  }
  return artifacts;
}

}  // namespace jobs::sqlite
