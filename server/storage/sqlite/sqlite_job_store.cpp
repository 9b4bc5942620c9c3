#include "server/storage/sqlite/sqlite_job_store.h"

#include <cassert>
#include <utility>

#include "server/storage/sqlite/database.h"
#include "server/storage/sqlite/folder_lock.h"
#include "server/storage/sqlite/group_commit.h"
#include "server/storage/sqlite/job_rows.h"
#include "server/storage/sqlite/list_query.h"
#include "server/storage/sqlite/read_pool.h"
#include "server/storage/sqlite/schema.h"

namespace jobs {

using sqlite::Database;
using sqlite::Query;

namespace {

std::unique_ptr<Database> open_for_writing(const std::string& path) {
  auto database = std::make_unique<Database>(path, Database::Access::read_write);
  sqlite::prepare_file(*database, path);
  return database;
}

/// Moves a job that runs under `fence` to an end; false when there is none such.
bool end(Database& database, const std::string& id, std::int64_t fence, std::int64_t now, JobState state) {
  assert(may_move(JobState::running, state));
  return database.change(
             "UPDATE jobs SET state = ?, ended_at = ?, cancel_requested = 0"
             " WHERE id = ? AND fence = ? AND state = 'running'",
             std::string(name_of(state)), now, id, fence) == 1;
}

}  // namespace

/// In the order of dependence: the lock goes last, the readers before the writer, which checkpoints as it closes.
struct SqliteJobStore::Parts {
  Parts(const std::string& folder, const std::string& path, const SqliteSettings& settings)
      : lock(folder), writer(open_for_writing(path)), reader(path, settings.read_connections) {}
  sqlite::FolderLock lock;
  sqlite::GroupCommit writer;
  sqlite::ReadPool reader;
};

SqliteJobStore::SqliteJobStore(const std::string& folder, SqliteSettings settings)
    : parts_(std::make_unique<Parts>(folder, folder + "/whittle.db", settings)) {}
SqliteJobStore::~SqliteJobStore() = default;

// ---- reads
// -----------------------------------------------------------------------------------------------------------

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

bool SqliteJobStore::references(const std::string& sha256) {
  return parts_->reader.run([&](Database& database) {
    return database.query("SELECT 1 FROM artifacts WHERE sha256 = ? LIMIT 1", sha256).row();
  });
}

bool SqliteJobStore::names_asset(const std::string& sha256) {
  return parts_->reader.run([&](Database& database) {
    return database.query("SELECT 1 FROM job_assets WHERE sha256 = ? LIMIT 1", sha256).row();
  });
}

// ---- writes
// ----------------------------------------------------------------------------------------------------------

void SqliteJobStore::submit(const Job& job, const std::string& document) {
  assert(job.state == JobState::queued);
  parts_->writer.run([&](Database& database) {
    sqlite::insert_job(database, job, document);
    return true;
  });
}

std::optional<Claim> SqliteJobStore::claim(const std::string& boot_id, std::int64_t now, bool alone) {
  std::optional<Claim> claim = parts_->writer.run([&](Database& database) -> std::optional<Claim> {
    std::string id;
    {
      Query next = database.query(
          "SELECT id FROM jobs INDEXED BY jobs_waiting WHERE state = 'queued' AND suspect = ?"
          " ORDER BY priority DESC, id LIMIT 1",
          std::int64_t{alone});
      if (!next.row()) return std::nullopt;
      id = next.text(0);
    }
    database.change(
        "UPDATE jobs SET state = 'running', started_at = ?, attempt = attempt + 1, fence = fence + 1, boot_id = ?"
        " WHERE id = ?",
        now, boot_id, id);
    Query fence = database.query("SELECT fence FROM jobs WHERE id = ?", id);
    fence.row();
    return Claim{sqlite::read_job(database, id).value(), {}, fence.integer(0)};
  });
  // Read outside the writer, which a large document would hold up: it cannot go while its job runs.
  if (claim) {
    try {
      claim->document = document(claim->job.id).value();
    } catch (...) {
      release(claim->job.id, claim->fence, now, false, false);  // nothing of the call has happened
      throw;
    }
  }
  return claim;
}

bool SqliteJobStore::succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
                             const std::vector<Artifact>& artifacts) {
  return parts_->writer.run([&](Database& database) {
    if (!end(database, id, fence, now, JobState::succeeded)) return false;
    database.change("INSERT INTO reports (job_id, report) VALUES (?, ?)", id, report);
    sqlite::insert_artifacts(database, id, artifacts);
    return true;
  });
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

bool SqliteJobStore::release(const std::string& id, std::int64_t fence, std::int64_t now, bool counts, bool suspect) {
  return parts_->writer.run([&](Database& database) {
    const int released = database.change(
        "UPDATE jobs SET state = iif(cancel_requested, 'cancelled', 'queued'),"
        " ended_at = iif(cancel_requested, ?, NULL), cancel_requested = 0, attempt = attempt - ?,"
        " suspect = max(suspect, ?) WHERE id = ? AND fence = ? AND state = 'running'",
        now, std::int64_t{!counts}, std::int64_t{suspect}, id, fence);
    return released == 1;
  });
}

CancelOutcome SqliteJobStore::cancel(const std::string& id, std::int64_t now) {
  return parts_->writer.run([&](Database& database) {
    if (database.change("UPDATE jobs SET state = 'cancelled', ended_at = ? WHERE id = ? AND state = 'queued'", now,
                        id) == 1) {
      return CancelOutcome::cancelled;
    }
    if (database.change("UPDATE jobs SET cancel_requested = 1 WHERE id = ? AND state = 'running'", id) == 1) {
      return CancelOutcome::cancelling;
    }
    return database.query("SELECT 1 FROM jobs WHERE id = ?", id).row() ? CancelOutcome::already_ended
                                                                       : CancelOutcome::unknown;
  });
}

Removal SqliteJobStore::remove(const std::string& id) {
  return parts_->writer.run([&](Database& database) -> Removal {
    Removal removal{RemoveOutcome::removed, sqlite::read_artifacts(database, id)};
    if (database.change("DELETE FROM jobs WHERE id = ? AND state <> 'running'", id) == 1) return removal;
    const bool running = database.query("SELECT 1 FROM jobs WHERE id = ?", id).row();
    return {running ? RemoveOutcome::running : RemoveOutcome::unknown, {}};
  });
}

int SqliteJobStore::recover(const std::string& boot_id, std::int64_t now) {
  return parts_->writer.run([&](Database& database) {
    return database.change(
        "UPDATE jobs SET state = iif(cancel_requested, 'cancelled', 'queued'),"
        " ended_at = iif(cancel_requested, ?, NULL), cancel_requested = 0, attempt = attempt - 1"
        " WHERE state = 'running' AND boot_id <> ?",
        now, boot_id);
  });
}

void SqliteJobStore::probe() {
  parts_->writer.run([](Database& database) { return database.change("UPDATE probe SET writes = writes + 1"); });
}

}  // namespace jobs
