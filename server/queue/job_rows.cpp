#include "server/queue/job_rows.h"

#include <algorithm>
#include <iterator>
#include <sstream>
#include <utility>

namespace queue {
namespace {

std::optional<api::Webhook> read_webhook(const sql::Query& row, int url_column) {
  if (row.is_null(url_column)) return std::nullopt;
  return api::Webhook{row.text(url_column), split(row.text(url_column + 1))};
}

void read_problem(sql::Database& database, Job& job, const sql::Query& row, int code_column) {
  if (row.is_null(code_column)) return;
  Problem problem{row.text(code_column), row.text(code_column + 1), {}};
  sql::Query errors =
      database.query("SELECT pointer, code, detail FROM problem_errors WHERE job_id = ? ORDER BY position", job.id);
  while (errors.row()) problem.errors.push_back({errors.text(0), errors.text(1), errors.text(2)});
  job.problem = std::move(problem);
}

void read_labels(sql::Database& database, Job& job) {
  sql::Query labels = database.query("SELECT key, value FROM labels WHERE job_id = ?", job.id);
  while (labels.row()) job.labels.emplace(labels.text(0), labels.text(1));
}

void read_report(sql::Database& database, Job& job) {
  sql::Query report = database.query("SELECT report FROM reports WHERE job_id = ?", job.id);
  if (report.row()) job.report = report.text(0);
}

void read_assets(sql::Database& database, Job& job) {
  sql::Query assets = database.query("SELECT sha256 FROM job_assets WHERE job_id = ? ORDER BY position", job.id);
  while (assets.row()) job.assets.push_back(assets.text(0));
}

constexpr std::int64_t first_fence = 1;

/// Adds a claim of the job to the passes.
void count_turn(sql::Database& database, const Job& job) {
  if (database.is_shared())
    return database.post("SELECT count_turn(?, ?)", job.owner, pass_of_turn / std::int64_t{job.weight});
  database.post("UPDATE latest_pass SET pass = max(pass, (SELECT pass FROM owner_usage WHERE owner = ?))", job.owner);
  database.post("UPDATE owner_usage SET pass = (SELECT pass FROM latest_pass) + ? / ? WHERE owner = ?", pass_of_turn,
                std::int64_t{job.weight}, job.owner);
}

constexpr const char* summary_columns = "kind, name, batch_id, owner, keep, state";

/// None without a row of the summary's columns.
std::optional<JobSummary> take_summary(const std::string& id, sql::Query row) {
  if (!row.row()) return std::nullopt;
  const JobKind kind = job_kind(row.text(0)).value();
  return JobSummary{
      id, kind, row.text(1), row.text(2), row.text(3), row.integer(4) != 0, job_state(row.text(5)).value()};
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

void insert_scene(sql::Database& database, const std::string& id, const CommonScene& scene) {
  database.post("INSERT INTO scenes (id, document) VALUES (?, ?)", id, sql::Blob{scene.document});
  for (const std::string& sha256 : scene.assets) {
    database.post("INSERT INTO scene_assets (sha256, scene_id) VALUES (?, ?)", sha256, id);
  }
}

void insert_job(sql::Database& database, const Job& job, const std::string& document,
                const std::optional<std::string>& scene_id, const std::optional<ClaimTerms>& terms) {
  std::optional<std::string> url, events, content_key, batch, boot_id;
  std::optional<std::int64_t> lease_until;
  if (terms) boot_id = terms->boot_id, lease_until = terms->lease_until;
  if (job.webhook) url = job.webhook->url, events = joined(job.webhook->events);
  if (!job.content_key.empty()) content_key = job.content_key;
  if (!job.batch.empty()) batch = job.batch;
  database.post(
      "INSERT INTO jobs (id, name, state, created_at, started_at, ended_at, attempt, max_attempts, priority,"
      " cancel_requested, suspect, width, height, owner, run_after, not_before, deadline, expires_in_s, expires_at,"
      " webhook_url, webhook_events, content_key, revision, rank, batch_id, batch_index,"
      " kind, accuracy, large, weight, work, variation, use_cache, keep, artifacts_synced, fence, boot_id, lease_until,"
      " formats, moved_at) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, "
      "?, ?, ?,"
      " ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      job.id, job.name, std::string(name_of(job.state)), job.created_at, job.started_at, job.ended_at,
      std::int64_t{job.attempt}, std::int64_t{job.max_attempts}, std::int64_t{job.priority},
      std::int64_t{job.cancel_requested}, std::int64_t{job.suspect}, std::int64_t{job.width}, std::int64_t{job.height},
      job.owner, job.run_after, job.not_before, job.deadline, job.expires_in_s, job.expires_at, url, events,
      content_key, job.revision, rank_of(job.created_at, job.run_after, job.priority), batch,
      std::int64_t{job.batch_index}, std::string(name_of(job.kind)), job.accuracy, std::int64_t{job.large},
      std::int64_t{job.weight}, job.work, job.variation, std::int64_t{job.use_cache}, std::int64_t{job.keep},
      std::int64_t{job.artifacts_synced}, terms ? first_fence : 0, boot_id, lease_until, job.formats,
      job.started_at.value_or(job.created_at));
  database.post("INSERT INTO documents (job_id, document, scene_id) VALUES (?, ?, ?)", job.id, sql::Blob{document},
                scene_id);
  insert_labels(database, job.id, job.labels);
  std::int64_t position = 0;
  for (const std::string& sha256 : job.assets) {
    database.post("INSERT INTO job_assets (job_id, position, sha256) VALUES (?, ?, ?)", job.id, position++, sha256);
  }
  if (job.state == JobState::running) {
    if (job.keep) {
      database.post(
          "INSERT INTO moves SELECT id, revision, moved_at, state, attempt, moved_for, boot_id FROM jobs"
          " WHERE id = ?",
          job.id);
    }
    count_turn(database, job);
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
        position++, artifact.name, artifact.media_type, artifact.sha256, static_cast<std::int64_t>(artifact.bytes), id);
  }
}

void lock_job(sql::Database& database, const std::string& id) {
  if (database.is_shared())
    database.query("SELECT 1 FROM jobs WHERE id = ?" + std::string(database.locking()), id).row();
}

std::optional<Job> read_job(sql::Database& database, const std::string& id) {
  sql::Query row = database.query(
      "SELECT name, state, created_at, started_at, ended_at, attempt, max_attempts, priority, cancel_requested,"
      " suspect, width, height, problem_code, problem_detail, owner, run_after, not_before, deadline, expires_in_s,"
      " expires_at, expired, webhook_url, webhook_events, content_key, revision, batch_id,"
      " batch_index, kind, accuracy, large, artifacts_synced, weight, work, variation, use_cache, keep,"
      " formats FROM jobs WHERE id = ?",
      id);
  if (!row.row()) return std::nullopt;
  Job job;
  job.id = id;
  job.name = row.text(0);
  job.state = job_state(row.text(1)).value();
  job.created_at = row.integer(2);
  job.started_at = row.optional_integer(3);
  job.ended_at = row.optional_integer(4);
  job.attempt = static_cast<int>(row.integer(5));
  job.max_attempts = static_cast<int>(row.integer(6));
  job.priority = static_cast<int>(row.integer(7));
  job.cancel_requested = row.integer(8) != 0;
  job.suspect = row.integer(9) != 0;
  job.width = static_cast<std::uint32_t>(row.integer(10));
  job.height = static_cast<std::uint32_t>(row.integer(11));
  read_problem(database, job, row, 12);
  job.owner = row.text(14);
  job.run_after = row.optional_integer(15);
  job.not_before = row.optional_integer(16);
  job.deadline = row.optional_integer(17);
  job.expires_in_s = row.optional_integer(18);
  job.expires_at = row.optional_integer(19);
  job.expired = row.integer(20) != 0;
  job.webhook = read_webhook(row, 21);
  job.content_key = row.text(23);
  job.revision = row.integer(24);
  job.batch = row.text(25);
  job.batch_index = static_cast<int>(row.integer(26));
  job.kind = job_kind(row.text(27)).value();
  job.accuracy = row.text(28);
  job.large = row.integer(29) != 0;
  job.artifacts_synced = row.integer(30) != 0;
  job.weight = static_cast<int>(row.integer(31));
  job.work = row.integer(32);
  job.variation = row.text(33);
  job.use_cache = row.integer(34) != 0;
  job.keep = row.integer(35) != 0;
  job.formats = row.text(36);
  read_labels(database, job);
  read_assets(database, job);
  if (job.state == JobState::succeeded) read_report(database, job);
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

std::optional<std::string> read_document(sql::Database& database, const std::string& id) {
  sql::Query query = database.query("SELECT document FROM documents WHERE job_id = ?", id);
  if (!query.row()) return std::nullopt;
  return query.text(0);
}

std::optional<std::string> read_scene(sql::Database& database, const std::string& id) {
  sql::Query query = database.query(
      "SELECT scenes.document FROM documents JOIN scenes ON scenes.id = documents.scene_id WHERE job_id = ?", id);
  if (!query.row()) return std::nullopt;
  return query.text(0);
}

void read_claimed_document(sql::Database& database, Claim& claim) {
  sql::Query row = database.query(
      "SELECT documents.document, scenes.document FROM documents LEFT JOIN scenes ON scenes.id = documents.scene_id"
      " WHERE job_id = ?",
      claim.job.id);
  row.row();
  claim.document = row.text(0);
  if (!row.is_null(1)) claim.scene = row.text(1);
}

std::vector<Artifact> read_artifacts(sql::Database& database, const std::string& id) {
  std::vector<Artifact> artifacts;
  sql::Query row =
      database.query("SELECT name, media_type, sha256, bytes FROM artifacts WHERE job_id = ? ORDER BY position", id);
  while (row.row()) {
    artifacts.push_back({row.text(0), row.text(1), row.text(2), static_cast<std::uint64_t>(row.integer(3))});
  }
  return artifacts;
}

std::int64_t read_artifact_bytes(sql::Database& database) {
  sql::Query total = database.query("SELECT bytes FROM artifact_total");
  total.row();
  return total.integer(0);
}

std::vector<JobMove> read_moves(sql::Database& database, const std::string& id) {
  std::vector<JobMove> moves;
  sql::Query row = database.query(
      "SELECT * FROM (SELECT at, state, attempt, reason, worker, revision FROM moves WHERE job_id = ?"
      " ORDER BY revision DESC LIMIT ?) AS latest ORDER BY revision",
      id, std::int64_t{moves_max});
  while (row.row()) {
    const std::string reason = row.text(3);
    const std::size_t space = std::min(reason.find(' '), reason.size());
    moves.push_back({row.integer(0), job_state(row.text(1)).value(), static_cast<int>(row.integer(2)),
                     reason.substr(0, space), reason.substr(std::min(space + 1, reason.size())), row.text(4)});
  }
  return moves;
}

// ---- batches and replies

void insert_batch(sql::Database& database, const Batch& batch) {
  std::optional<std::int64_t> max_failed;
  if (batch.max_failed) max_failed = *batch.max_failed;
  database.post(
      "INSERT INTO batches (id, owner, name, sweep, created_at, max_failed, size) VALUES (?, ?, ?, ?, ?, ?, ?)",
      batch.id, batch.owner, batch.name, batch.sweep, batch.created_at, max_failed, std::int64_t{batch.size});
}

std::optional<BatchState> read_batch(sql::Database& database, const std::string& id) {
  sql::Query row =
      database.query("SELECT owner, name, sweep, created_at, max_failed, size FROM batches WHERE id = ?", id);
  if (!row.row()) return std::nullopt;
  BatchState state{{id, row.text(0), row.text(1), row.text(2), row.integer(3), {}, static_cast<int>(row.integer(5))},
                   {}};
  if (const auto max_failed = row.optional_integer(4)) state.batch.max_failed = static_cast<int>(*max_failed);
  sql::Query counts =
      database.query("SELECT state, count(*) FROM jobs INDEXED BY jobs_by_batch WHERE batch_id = ? GROUP BY state", id);
  while (counts.row()) state.jobs.emplace(job_state(counts.text(0)).value(), counts.integer(1));
  return state;
}

bool insert_reply(sql::Database& database, const KeptReply& kept, std::int64_t now) {
  return database.change(
             "INSERT INTO replies (owner, route, key, request_sha256, status, location, body, expires_at)"
             " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8) ON CONFLICT (owner, route, key) DO UPDATE SET"
             " request_sha256 = ?4, status = ?5, location = ?6, body = ?7, expires_at = ?8"
             " WHERE replies.expires_at <= ?9",
             kept.key.owner, kept.key.route, kept.key.key, kept.request_sha256, std::int64_t{kept.reply.status},
             kept.reply.location, kept.reply.body, kept.expires_at, now) == 1;
}

std::optional<KeptReply> read_reply(sql::Database& database, const ReplyKey& key, std::int64_t now) {
  sql::Query row = database.query(
      "SELECT request_sha256, status, location, body, expires_at FROM replies"
      " WHERE owner = ? AND route = ? AND key = ? AND expires_at > ?",
      key.owner, key.route, key.key, now);
  if (!row.row()) return std::nullopt;
  const FirstReply reply{static_cast<int>(row.integer(1)), row.text(2), row.text(3)};
  return KeptReply{key, row.text(0), reply, row.integer(4)};
}

// ---- claims

Claim claim_job(sql::Database& database, const std::string& id, const ClaimTerms& terms, std::int64_t now) {
  Claim claim;
  {
    sql::Query claimed = database.query(
        "UPDATE jobs SET state = 'running', started_at = max(?1, created_at), moved_at = ?1, moved_for = '',"
        " attempt = attempt + 1, fence = fence + 1, boot_id = ?2, lease_until = ?3, revision = revision + 1"
        " WHERE id = ?4 RETURNING fence",
        now, terms.boot_id, terms.lease_until, id);
    claimed.row();
    claim.fence = claimed.integer(0);
  }
  claim.job = read_job(database, id).value();
  // Outside the only writer, which a large document would delay.
  if (database.is_shared()) read_claimed_document(database, claim);
  count_turn(database, claim.job);
  return claim;
}

std::optional<Claim> claim_unstored(sql::Database& database, const Job& job, std::int64_t now) {
  if (job.deadline && *job.deadline <= now) return std::nullopt;
  if (database.query("SELECT 1 FROM jobs INDEXED BY jobs_waiting WHERE state = 'queued' AND not_before IS NULL LIMIT 1")
          .row()) {
    return std::nullopt;
  }
  Claim claim{.job = job, .document = {}, .fence = first_fence, .is_last = !database.is_shared()};
  claim.job.state = JobState::running;
  claim.job.started_at = std::max(now, job.created_at);
  ++claim.job.attempt;
  ++claim.job.revision;
  return claim;
}

}  // namespace queue
