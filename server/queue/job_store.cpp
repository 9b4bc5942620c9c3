/// Rows of jobs, their pages and counts. Reads have connections of their own, so that writes do not delay them.

#include <algorithm>
#include <cassert>
#include <limits>
#include <map>
#include <utility>

#include "server/queue/job_rows.h"
#include "server/support/text_values.h"

namespace queue {
namespace {

std::int64_t count_jobs(sql::Database& database, JobState state) {
  return database.number("SELECT jobs FROM job_counts WHERE state = ?", state);
}

// ---- pages

/// Counting stops here: longer walks cost the same.
constexpr std::int64_t many = 1000;

using Label = std::pair<std::string, std::string>;

/// The index that a page walks. Each holds the ids in order, so the walk ends when the page is full; the other
/// conditions are checked by id.
struct Walk {
  enum class Over { jobs, state, label, batch };
  Over over = Over::jobs;
  Label label;
};

std::int64_t count_labelled(sql::Database& database, const Label& label) {
  return database.number("SELECT count(*) FROM (SELECT 1 FROM labels WHERE key = ? AND value = ? LIMIT ?) AS counted",
                         label.first, label.second, many);
}

/// The shortest walk: the rarest label, or the state where that is rarer.
Walk choose_walk(sql::Database& database, const JobFilter& filter) {
  Walk walk;
  if (!filter.batch.empty() && filter.batch != "none") return {Walk::Over::batch, {}};
  std::int64_t shortest = std::numeric_limits<std::int64_t>::max();
  for (const auto& [key, value] : filter.labels) {
    const Label label(key, value);
    const std::int64_t count = count_labelled(database, label);
    if (count < shortest) walk = {Walk::Over::label, label};
    shortest = std::min(shortest, count);
  }
  if (filter.state && count_jobs(database, *filter.state) < shortest) walk.over = Walk::Over::state;
  return walk;
}

std::string list_sql(Walk::Over over, std::size_t other_labels, const JobFilter& filter) {
  std::string sql = "SELECT jobs.id FROM ";
  std::string id = "jobs.id";
  switch (over) {
    case Walk::Over::label:  // CROSS JOIN: SQLite keeps the order written
      id = "walked.job_id";
      sql +=
          "labels AS walked CROSS JOIN jobs WHERE jobs.id = walked.job_id AND walked.key = ? AND walked.value = ? AND ";
      break;
    case Walk::Over::state:
      sql += "jobs INDEXED BY jobs_by_state WHERE ";
      break;
    case Walk::Over::batch:
      sql += "jobs INDEXED BY jobs_by_batch WHERE jobs.batch_id = ? AND ";
      break;
    case Walk::Over::jobs:
      sql += "jobs WHERE ";
      break;
  }
  sql += id + (filter.batch == "none" ? " < ? AND jobs.keep = 1 AND jobs.batch_id IS NULL" : " < ? AND jobs.keep = 1");
  if (filter.state) sql += " AND jobs.state = ?";
  for (std::size_t i = 0; i < other_labels; ++i) {
    sql += " AND EXISTS (SELECT 1 FROM labels WHERE key = ? AND value = ? AND job_id = jobs.id)";
  }
  if (!filter.text.empty()) sql += " AND instr(lower(jobs.name), ?) > 0";
  if (filter.kind) sql += " AND jobs.kind = ?";
  if (filter.owner) sql += " AND jobs.owner = ?";
  if (filter.created_after) sql += " AND jobs.created_at >= ?";
  if (filter.created_before) sql += " AND jobs.created_at < ?";
  return sql + " ORDER BY " + id + " DESC LIMIT ?";
}

/// Ids of at most `limit` matching jobs older than `cursor` (empty: from the newest), newest first: over 100,000 jobs
/// in milliseconds.
std::vector<std::string> list_ids(sql::Database& database, const JobFilter& filter, const std::string& cursor,
                                  int limit) {
  const Walk walk = choose_walk(database, filter);
  std::map<std::string, std::string> others = filter.labels;
  if (walk.over == Walk::Over::label) others.erase(walk.label.first);

  sql::Query query = database.query(list_sql(walk.over, others.size(), filter));
  int position = 0;
  if (walk.over == Walk::Over::label) {
    query.bind(++position, walk.label.first);
    query.bind(++position, walk.label.second);
  }
  if (walk.over == Walk::Over::batch) query.bind(++position, filter.batch);
  query.bind(++position, cursor.empty() ? std::string("~") : cursor);  // greater than every id
  if (filter.state) query.bind(++position, *filter.state);
  for (const auto& [key, value] : others) {
    query.bind(++position, key);
    query.bind(++position, value);
  }
  if (!filter.text.empty()) query.bind(++position, support::lowered(filter.text));
  if (filter.kind) query.bind(++position, *filter.kind);
  if (filter.owner) query.bind(++position, *filter.owner);
  for (const auto& moment : {filter.created_after, filter.created_before})
    if (moment) query.bind(++position, *moment);
  query.bind(++position, limit);
  return query.texts();
}

// ---- position in the queue

constexpr const char* waiting_of_owner =
    "SELECT rank, id, work FROM jobs INDEXED BY jobs_waiting"
    " WHERE suspect = ?1 AND owner = ?2 AND state = 'queued' AND not_before IS NULL ORDER BY rank, id";

constexpr const char* sum_of_work = "SELECT count(*), CAST(coalesce(sum(work), 0) AS BIGINT) FROM ";

/// Jobs of one owner that are claimed before its pass reaches that of another claim.
struct Turns {
  std::string owner;
  std::int64_t pass = 0, weight = 1;

  /// Number of claims at a lower pass than `end`.
  [[nodiscard]] std::int64_t before(std::int64_t end) const {
    const std::int64_t each = pass_of_turn / weight;
    return end <= pass ? 0 : (end - pass + each - 1) / each;
  }
};

/// All owners of waiting jobs; the weight is that of their first.
std::vector<Turns> read_turns(sql::Database& database, std::int64_t suspect) {
  sql::Query rows = database.query(
      "SELECT owners.owner, max(owners.pass, (SELECT pass FROM latest_pass)), next.weight"
      " FROM owners CROSS JOIN jobs AS next WHERE next.id = (SELECT id FROM jobs INDEXED BY jobs_waiting"
      "   WHERE suspect = ? AND owner = owners.owner AND state = 'queued' AND not_before IS NULL"
      "   ORDER BY rank, id LIMIT 1) AND queued_jobs > 0",
      suspect);
  return rows.all([](const sql::Query& row) { return Turns{row.text(0), row.integer(1), row.integer(2)}; });
}

/// Adds the first `limit` waiting jobs of the owner.
void add_waiting(sql::Database& database, std::int64_t suspect, const std::string& owner, std::int64_t limit,
                 JobsBefore& before) {
  sql::Query sums = database.query(sum_of_work + std::string("(") + waiting_of_owner + " LIMIT ?3) AS waiting", suspect,
                                   owner, limit);
  sums.row();
  before.jobs += sums.integer(0);
  before.work += sums.integer(1);
}

std::optional<JobsBefore> read_queue_position(sql::Database& database, const std::string& id, std::int64_t limit) {
  std::string owner;
  std::int64_t suspect = 0, rank = 0;
  {
    sql::Query job = database.query(
        "SELECT owner, suspect, rank FROM jobs WHERE id = ? AND state = 'queued' AND not_before IS NULL", id);
    if (!job.row()) return std::nullopt;
    job.take(owner, suspect, rank);
  }
  JobsBefore before;
  {
    sql::Query own = database.query(
        sum_of_work +
            std::string("(SELECT work FROM jobs INDEXED BY jobs_waiting WHERE suspect = ?1 AND owner = ?2"
                        " AND state = 'queued' AND not_before IS NULL AND (rank, id) < (?3, ?4) LIMIT ?5) AS before"),
        suspect, owner, rank, id, limit);
    own.row();
    own.take(before.jobs, before.work);
  }
  const std::vector<Turns> turns = read_turns(database, suspect);
  std::int64_t pass = 0;
  for (const Turns& other : turns)
    if (other.owner == owner) pass = other.pass + before.jobs * (pass_of_turn / other.weight);
  for (const Turns& other : turns) {
    if (other.owner == owner || before.jobs >= limit) continue;
    const std::int64_t turns_before = other.before(pass);
    add_waiting(database, suspect, other.owner, std::min(turns_before, limit), before);
    if (other.before(pass + 1) == turns_before) continue;
    // Both have a turn at the same pass: the lower rank is first.
    sql::Query next =
        database.query(std::string(waiting_of_owner) + " LIMIT 1 OFFSET ?3", suspect, other.owner, turns_before);
    if (!next.row() || std::pair(next.integer(0), next.text(1)) > std::pair(rank, id)) continue;
    ++before.jobs;
    before.work += next.integer(2);
  }
  if (suspect == 0) {  // suspects run before all others
    for (const Turns& other : read_turns(database, 1)) add_waiting(database, 1, other.owner, limit, before);
  }
  before.jobs = std::min(before.jobs, limit);
  return before;
}

// ---- replies

/// Replaces an expired reply under the same key. False, and nothing is changed, if there is one that has not expired.
bool insert_reply(sql::Database& database, const KeptReply& kept, std::int64_t now) {
  return database.change(
             "INSERT INTO replies (owner, route, key, request_sha256, status, location, body, expires_at)"
             " VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8) ON CONFLICT (owner, route, key) DO UPDATE SET"
             " request_sha256 = ?4, status = ?5, location = ?6, body = ?7, expires_at = ?8"
             " WHERE replies.expires_at <= ?9",
             kept.key.owner, kept.key.route, kept.key.key, kept.request_sha256, kept.reply.status, kept.reply.location,
             kept.reply.body, kept.expires_at, now) == 1;
}

std::optional<KeptReply> read_reply(sql::Database& database, const ReplyKey& key, std::int64_t now) {
  sql::Query row = database.query(
      "SELECT request_sha256, status, location, body, expires_at FROM replies"
      " WHERE owner = ? AND route = ? AND key = ? AND expires_at > ?",
      key.owner, key.route, key.key, now);
  if (!row.row()) return std::nullopt;
  KeptReply kept;
  kept.key = key;
  row.take(kept.request_sha256, kept.reply.status, kept.reply.location, kept.reply.body, kept.expires_at);
  return kept;
}

}  // namespace

std::optional<KeptReply> JobStore::insert(const InsertRequest& request, std::int64_t now) {
  const auto work = [&](sql::Database& database) -> std::optional<KeptReply> {
    if (request.reply && !insert_reply(database, *request.reply, now))
      return read_reply(database, request.reply->key, now).value();
    std::optional<std::string> scene_id;
    if (const auto& batch = request.batch)
      database.post(
          "INSERT INTO batches (id, owner, name, sweep, created_at, max_failed, size) VALUES (?, ?, ?, ?, ?, ?, ?)",
          batch->id, batch->owner, batch->name, batch->sweep, batch->created_at, batch->max_failed, batch->size);
    if (const auto& scene = request.scene) {
      const std::string& id = scene_id.emplace(request.batch.value().id);
      database.post("INSERT INTO scenes (id, document) VALUES (?, ?)", id, sql::Blob{scene->document});
      for (const std::string& sha256 : scene->assets)
        database.post("INSERT INTO scene_assets (sha256, scene_id) VALUES (?, ?)", sha256, id);
    }
    for (const auto& [job, document] : request.jobs) {
      assert(job.state == JobState::queued || job.state == JobState::succeeded);
      insert_job(database, job, document, scene_id);
    }
    return std::nullopt;
  };
  return transactions_.write(work, sql::synced(request.durable));
}

std::optional<KeptReply> JobStore::find_reply(const ReplyKey& key, std::int64_t now) {
  return transactions_.read([&](sql::Database& database) { return read_reply(database, key, now); });
}

std::optional<Job> JobStore::find(const std::string& id) {
  return transactions_.read([&](sql::Database& database) { return read_job(database, id); });
}

std::optional<JobSummary> JobStore::summary(const std::string& id) {
  return transactions_.read([&](sql::Database& database) { return read_summary(database, id); });
}

std::vector<JobMove> JobStore::moves(const std::string& id) {
  return transactions_.read([&](sql::Database& database) {
    std::vector<JobMove> moves;
    sql::Query row = database.query(
        "SELECT * FROM (SELECT at, state, attempt, reason, worker, revision FROM moves WHERE job_id = ?"
        " ORDER BY revision DESC LIMIT ?) AS latest ORDER BY revision",
        id, moves_max);
    while (row.row()) {
      JobMove& move = moves.emplace_back();
      row.take(move.at, move.state, move.attempt, move.code, move.worker);
      const std::size_t space = std::min(move.code.find(' '), move.code.size());
      move.detail = move.code.substr(std::min(space + 1, move.code.size()));
      move.code.resize(space);
    }
    return moves;
  });
}

std::optional<Job> JobStore::find_by_content_key(const std::string& content_key, std::int64_t expires_after) {
  return transactions_.read([&](sql::Database& database) -> std::optional<Job> {
    sql::Query newest = database.query(
        "SELECT id FROM jobs INDEXED BY jobs_by_content WHERE content_key = ? AND state = 'succeeded' AND expired = 0"
        " AND (expires_at IS NULL OR expires_at > ?) ORDER BY id DESC LIMIT 1",
        content_key, expires_after);
    if (!newest.row()) return std::nullopt;
    return read_job(database, newest.text(0));
  });
}

std::optional<std::string> JobStore::document(const std::string& id) {
  return transactions_.first_text("SELECT document FROM documents WHERE job_id = ?", id);
}

std::optional<std::string> JobStore::scene(const std::string& id) {
  return transactions_.first_text(
      "SELECT scenes.document FROM documents JOIN scenes ON scenes.id = documents.scene_id WHERE job_id = ?", id);
}

JobPage JobStore::list(const JobFilter& filter, const std::string& cursor, int limit) {
  return transactions_.read([&](sql::Database& database) {
    std::vector<std::string> ids = list_ids(database, filter, cursor, limit + 1);
    JobPage page;
    if (ids.size() > static_cast<std::size_t>(limit)) {
      ids.pop_back();
      page.next_cursor = ids.back();
    }
    for (const std::string& id : ids) page.items.push_back(read_job(database, id).value());
    return page;
  });
}

ChangeOutcome JobStore::change(const std::string& id, const JobChange& change, std::optional<std::int64_t> revision,
                               bool durable) {
  using Outcome = ChangeOutcome;
  const auto work = [&](sql::Database& database) {
    lock_job(database, id);
    const std::optional<Job> job = read_job(database, id);
    if (!job) return Outcome::unknown;
    if (revision && *revision != job->revision) return Outcome::other_revision;
    if (change.priority && ended(job->state)) return Outcome::ended;
    if (change.expires_at && job->expired) return Outcome::expired;
    const int priority = change.priority.value_or(job->priority);
    const std::int64_t rank_change = rank_of(0, {}, priority) - rank_of(0, {}, job->priority);
    database.change(
        "UPDATE jobs SET name = ?, priority = ?, rank = rank + ?, expires_at = ?, revision = revision + 1"
        " WHERE id = ?",
        change.name.value_or(job->name), priority, rank_change,
        change.expires_at ? *change.expires_at : job->expires_at, id);
    if (change.labels) {
      database.change("DELETE FROM labels WHERE job_id = ?", id);
      insert_labels(database, id, *change.labels);
    }
    return Outcome::changed;
  };
  return transactions_.write(work, sql::synced(durable));
}

Removal JobStore::remove(const std::string& id, bool durable) {
  using Outcome = RemoveOutcome;
  const auto work = [&](sql::Database& database) -> Removal {
    lock_job(database, id);
    const std::vector<Artifact> artifacts = read_artifacts(database, id);
    if (const auto job = delete_job(database, id)) return {Outcome::removed, artifacts, *job};
    return {read_summary(database, id) ? Outcome::running : Outcome::unknown, {}};
  };
  return transactions_.write(work, sql::synced(durable));
}

std::int64_t JobStatistics::count(JobState state) {
  return transactions_.read([&](sql::Database& database) { return count_jobs(database, state); });
}

OwnerUsage JobStatistics::owner_usage(const std::string& owner) {
  return transactions_.read([&](sql::Database& database) {
    OwnerUsage usage{.all_queued_jobs = count_jobs(database, JobState::queued)};
    sql::Query row = database.query("SELECT queued_jobs, artifact_bytes FROM owners WHERE owner = ?", owner);
    if (row.row()) usage.queued_jobs = row.integer(0), usage.artifact_bytes = row.integer(1);
    return usage;
  });
}

std::int64_t JobStatistics::artifact_bytes() {
  return transactions_.read([](sql::Database& database) { return read_artifact_bytes(database); });
}

QueueDepth JobStatistics::depth() {
  return transactions_.read([&](sql::Database& database) {
    QueueDepth depth;
    sql::Query queued = database.query("SELECT priority, jobs FROM queued_by_priority WHERE jobs > 0");
    while (queued.row()) depth.queued_by_priority.emplace(static_cast<int>(queued.integer(0)), queued.integer(1));
    sql::Query delayed = database.query(
        "SELECT count(*),"
        " CAST((SELECT work FROM job_counts WHERE state = 'queued') - coalesce(sum(work), 0) AS BIGINT)"
        " FROM jobs INDEXED BY jobs_delayed WHERE not_before IS NOT NULL");
    delayed.row();
    delayed.take(depth.delayed, depth.work);
    // Ids are in order of creation.
    sql::Query oldest = database.query(
        "SELECT max(created_at, coalesce(run_after, created_at)) FROM jobs INDEXED BY jobs_by_state"
        " WHERE state = 'queued' AND not_before IS NULL ORDER BY id LIMIT 1");
    if (oldest.row()) depth.oldest_at = oldest.integer(0);
    return depth;
  });
}

std::optional<JobsBefore> JobStatistics::queue_position(const std::string& id, std::int64_t limit) {
  return transactions_.read(
      [&](sql::Database& database) -> std::optional<JobsBefore> { return read_queue_position(database, id, limit); });
}

}  // namespace queue
