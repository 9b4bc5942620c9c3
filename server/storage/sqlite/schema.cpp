#include "server/storage/sqlite/schema.h"

#include <array>

#include "server/jobs/job_store.h"

namespace jobs::sqlite {
namespace {

/// Step n brings a file from version n to n + 1. A step that was released is never changed; a new one is added.
/// Names are those of HTTP.md and server/jobs/job.h. Times are milliseconds since 1970 UTC.
constexpr std::array<const char*, 2> steps = {R"sql(
-- Small rows clustered by id, which is creation order: pages and text searches read neighbours. What is large or many
-- has its own table.
CREATE TABLE jobs (
  id TEXT NOT NULL PRIMARY KEY,
  name TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
  created_at INTEGER NOT NULL,
  started_at INTEGER,
  ended_at INTEGER,
  attempt INTEGER NOT NULL CHECK (attempt >= 0),
  max_attempts INTEGER NOT NULL,
  priority INTEGER NOT NULL,
  cancel_requested INTEGER NOT NULL,
  suspect INTEGER NOT NULL,
  width INTEGER NOT NULL,
  height INTEGER NOT NULL,
  problem_code TEXT,
  problem_detail TEXT,
  fence INTEGER NOT NULL DEFAULT 0,  -- grows with every claim
  boot_id TEXT                       -- of the daemon that claimed it last
) STRICT, WITHOUT ROWID;
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_waiting ON jobs (suspect, priority DESC, id) WHERE state = 'queued';

CREATE TABLE documents (
  job_id TEXT NOT NULL PRIMARY KEY REFERENCES jobs ON DELETE CASCADE,
  document BLOB NOT NULL
) STRICT;
CREATE TABLE reports (
  job_id TEXT NOT NULL PRIMARY KEY REFERENCES jobs ON DELETE CASCADE,
  report TEXT NOT NULL
) STRICT;
CREATE TABLE labels (
  key TEXT NOT NULL,
  value TEXT NOT NULL,
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  PRIMARY KEY (key, value, job_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX labels_of_job ON labels (job_id, key, value);
CREATE TABLE artifacts (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  name TEXT NOT NULL,
  media_type TEXT NOT NULL,
  sha256 TEXT NOT NULL,
  bytes INTEGER NOT NULL,
  PRIMARY KEY (job_id, position)
) STRICT, WITHOUT ROWID;
CREATE INDEX artifacts_by_sha256 ON artifacts (sha256);
CREATE TABLE problem_errors (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  pointer TEXT NOT NULL,
  code TEXT NOT NULL,
  detail TEXT NOT NULL,
  PRIMARY KEY (job_id, position)
) STRICT, WITHOUT ROWID;

-- Kept by triggers, so that the bound on waiting jobs is checked without counting them.
CREATE TABLE job_counts (state TEXT NOT NULL PRIMARY KEY, jobs INTEGER NOT NULL) STRICT, WITHOUT ROWID;
INSERT INTO job_counts VALUES ('queued', 0), ('running', 0), ('succeeded', 0), ('failed', 0), ('cancelled', 0);
CREATE TRIGGER job_came AFTER INSERT ON jobs BEGIN
  UPDATE job_counts SET jobs = jobs + 1 WHERE state = new.state;
END;
CREATE TRIGGER job_moved AFTER UPDATE OF state ON jobs WHEN old.state <> new.state BEGIN
  UPDATE job_counts SET jobs = jobs - 1 WHERE state = old.state;
  UPDATE job_counts SET jobs = jobs + 1 WHERE state = new.state;
END;
CREATE TRIGGER job_went AFTER DELETE ON jobs BEGIN
  UPDATE job_counts SET jobs = jobs - 1 WHERE state = old.state;
END;

CREATE TABLE probe (writes INTEGER NOT NULL) STRICT;
INSERT INTO probe VALUES (0);
)sql",
                                              R"sql(
-- The uploads that a job's document names.
CREATE TABLE job_assets (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  sha256 TEXT NOT NULL,
  PRIMARY KEY (job_id, position)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_assets_by_sha256 ON job_assets (sha256);
)sql"};

std::int64_t user_version(Database& database) {
  Query query = database.query("PRAGMA user_version");
  query.row();
  return query.integer(0);
}

}  // namespace

void prepare_file(Database& database, const std::string& path) {
  const std::int64_t version = user_version(database);
  constexpr auto current = static_cast<std::int64_t>(steps.size());
  if (version > current) {
    throw StoreFailure(StoreFailure::Kind::unavailable,
                       path + " was written by a newer program: its schema has version " + std::to_string(version) +
                           ", this one knows " + std::to_string(current));
  }
  // FULL: with WAL it is what never lost an acknowledged commit at a power cut. The size limit gives the disk back
  // after a burst of large documents.
  database.script(
      "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; PRAGMA cache_size = -8000;"
      "PRAGMA journal_size_limit = 67108864;");
  database.checkpoint_at(1000, 8000);  // 4 MB as SQLite's default; 32 MB, a few large documents
  for (std::int64_t next = version; next < current; ++next) {
    database.script("BEGIN IMMEDIATE;" + std::string(steps[static_cast<std::size_t>(next)]) +
                    "PRAGMA user_version = " + std::to_string(next + 1) + "; COMMIT;");
  }
}

}  // namespace jobs::sqlite
