/// How jobs come, run and end. What is only read stands in sqlite_job_reads.cpp, what owners and the housekeeper change
/// in sqlite_job_changes.cpp.

#include "server/storage/sqlite/sqlite_job_store.h"

#include <cassert>
#include <utility>

#include "server/storage/sqlite/batch_rows.h"
#include "server/storage/sqlite/connections.h"
#include "server/storage/sqlite/job_moves.h"
#include "server/storage/sqlite/job_rows.h"
#include "server/storage/sqlite/reply_rows.h"

namespace queue {

using sqlite::Database;
using sqlite::Query;
using sqlite::Synced;

namespace {

Synced synced(bool durable) { return durable ? Synced::now : Synced::with_next; }

/// Moves a job that runs under `fence` to an end; false when there is none such.
bool end(Database& database, const std::string& id, std::int64_t fence, std::int64_t now, JobState state) {
  assert(may_move(JobState::running, state));
  return database.change(
             "UPDATE jobs SET state = ?1, ended_at = ?2, cancel_requested = 0, revision = revision + 1,"
             " expires_at = coalesce(expires_at, ?2 + 1000 * expires_in_s)"
             " WHERE id = ?3 AND fence = ?4 AND state = 'running'",
             std::string(name_of(state)), now, id, fence) == 1;
}

}  // namespace

SqliteJobStore::SqliteJobStore(const std::string& directory, SqliteSettings settings)
    : parts_(std::make_unique<Connections>(directory, directory + "/whittle.db", settings)) {}
SqliteJobStore::~SqliteJobStore() = default;

std::optional<KeptReply> SqliteJobStore::insert_job(const InsertRequest& admission, std::int64_t now) {
  const auto work = [&](Database& database) -> std::optional<KeptReply> {
    if (admission.reply) {
      if (auto earlier = sqlite::read_reply(database, admission.reply->key, now)) return earlier;
      sqlite::insert_reply(database, *admission.reply);
    }
    if (admission.batch) sqlite::insert_batch(database, *admission.batch);
    for (const auto& [job, document] : admission.jobs) {
      assert(job.state == JobState::queued || job.state == JobState::succeeded);
      sqlite::insert_job(database, job, document);
    }
    return std::nullopt;
  };
  return parts_->writer.run(work, synced(admission.durable));
}

std::optional<Claim> SqliteJobStore::claim(const std::string& boot_id, std::int64_t now, std::int64_t lease_until,
                                           bool alone) {
  return claim_of(alone ? "jobs_waiting WHERE suspect = 1" : "jobs_waiting WHERE suspect = 0", boot_id, now,
                  lease_until);
}

std::optional<Claim> SqliteJobStore::claim_small(const std::string& boot_id, std::int64_t now,
                                                 std::int64_t lease_until) {
  return claim_of("small_jobs_waiting WHERE suspect = 0 AND large = 0", boot_id, now, lease_until);
}

std::optional<Claim> SqliteJobStore::claim_of(const char* waiting, const std::string& boot_id, std::int64_t now,
                                              std::int64_t lease_until) {
  const auto work = [&](Database& database) -> std::optional<Claim> {
    std::string id;
    {
      Query next =
          database.query("SELECT id FROM jobs INDEXED BY " + std::string(waiting) +
                             " AND state = 'queued' AND not_before IS NULL AND (deadline IS NULL OR deadline > ?)"
                             " ORDER BY rank, id LIMIT 1",
                         now);
      if (!next.row()) return std::nullopt;
      id = next.text(0);
    }
    database.change(
        "UPDATE jobs SET state = 'running', started_at = ?, attempt = attempt + 1, fence = fence + 1, boot_id = ?,"
        " lease_until = ?, revision = revision + 1 WHERE id = ?",
        now, boot_id, lease_until, id);
    Query fence = database.query("SELECT fence FROM jobs WHERE id = ?", id);
    fence.row();
    return Claim{sqlite::read_job(database, id).value(), {}, fence.integer(0)};
  };
  std::optional<Claim> claim = parts_->writer.run(work, Synced::with_next);
  // Read outside the writer, which a large document would hold up: it cannot go while its job runs.
  if (claim) {
    try {
      claim->document = document(claim->job.id).value();
    } catch (...) {
      release(claim->job.id, claim->fence, now, {});  // nothing of the call has happened
      throw;
    }
  }
  return claim;
}

std::vector<Lease> SqliteJobStore::renew(const std::vector<Lease>& leases, std::int64_t until) {
  const auto work = [&](Database& database) {
    std::vector<Lease> lost;
    for (const Lease& lease : leases) {
      const int renewed =
          database.change("UPDATE jobs SET lease_until = ? WHERE id = ? AND fence = ? AND state = 'running'", until,
                          lease.job_id, lease.fence);
      if (renewed == 0) lost.push_back(lease);
    }
    return lost;
  };
  return parts_->writer.run(work, Synced::with_next);
}

bool SqliteJobStore::succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
                             const std::vector<Artifact>& artifacts, bool durable,
                             const std::vector<SmallImage>& small) {
  const auto work = [&](Database& database) {
    if (!end(database, id, fence, now, JobState::succeeded)) return false;
    sqlite::insert_report(database, id, report);
    sqlite::insert_artifacts(database, id, artifacts);
    for (const auto& [sha256, bytes] : small) {
      database.change("INSERT INTO small_images VALUES (?, ?) ON CONFLICT DO NOTHING", sha256, sqlite::Blob{bytes});
    }
    return true;
  };
  return parts_->writer.run(work, synced(durable));
}

bool SqliteJobStore::fail(const std::string& id, std::int64_t fence, std::int64_t now, const Problem& problem) {
  return parts_->writer.run([&](Database& database) {
    if (!end(database, id, fence, now, JobState::failed)) return false;
    sqlite::insert_problem(database, id, problem);
    return true;
  });
}

bool SqliteJobStore::finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) {
  return parts_->writer.run([&](Database& database) { return end(database, id, fence, now, JobState::cancelled); });
}

bool SqliteJobStore::release(const std::string& id, std::int64_t fence, std::int64_t now, const Release& how) {
  return parts_->writer.run([&](Database& database) {
    const int released =
        database.change(std::string(sqlite::given_back) +
                            " attempt = attempt - ?2, suspect = max(suspect, ?3),"
                            " not_before = iif(cancel_requested, NULL, ?4)"
                            " WHERE id = ?5 AND fence = ?6 AND state = 'running'",
                        now, std::int64_t{!how.counts}, std::int64_t{how.suspect}, how.not_before, id, fence);
    return released == 1;
  });
}

CancelOutcome SqliteJobStore::cancel(const std::string& id, std::int64_t now) {
  return parts_->writer.run([&](Database& database) { return sqlite::cancel_job(database, id, now); });
}

Removal SqliteJobStore::remove(const std::string& id) {
  return parts_->writer.run([&](Database& database) -> Removal {
    Removal removal{RemoveOutcome::removed, sqlite::read_artifacts(database, id)};
    if (database.change("DELETE FROM jobs WHERE id = ? AND state <> 'running'", id) == 1) return removal;
    const bool running = database.query("SELECT 1 FROM jobs WHERE id = ?", id).row();
    return {running ? RemoveOutcome::running : RemoveOutcome::unknown, {}};
  });
}

void SqliteJobStore::forget_small_image(const std::string& sha256) {
  if (!small_image(sha256)) return;  // a look costs less than a write
  const auto work = [&](Database& database) {
    return database.change(
        "DELETE FROM small_images WHERE sha256 = ?1 AND NOT EXISTS (SELECT 1 FROM artifacts WHERE sha256 = ?1)",
        sha256);
  };
  parts_->writer.run(work, Synced::with_next);
}

int SqliteJobStore::recover(const std::string& boot_id, std::int64_t now) {
  return parts_->writer.run([&](Database& database) {
    return database.change(
        std::string(sqlite::given_back) + " attempt = attempt - 1 WHERE state = 'running' AND boot_id <> ?2", now,
        boot_id);
  });
}

void SqliteJobStore::probe() {
  parts_->writer.run([](Database& database) { return database.change("UPDATE probe SET writes = writes + 1"); });
}

}  // namespace queue
