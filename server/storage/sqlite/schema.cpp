#include "server/storage/sqlite/schema.h"

#include <array>

#include "server/queue/job_store.h"

namespace queue::sqlite {
namespace {

/// Step n brings a file from version n to n + 1. A step that was released is never changed; a new one is added.
/// Names are those of HTTP.md and server/jobs/job.h. Times are milliseconds since 1970 UTC.
constexpr std::array<const char*, schema_version> steps = {R"sql(
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
CREATE TRIGGER on_job_available AFTER INSERT ON jobs BEGIN
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
-- What a document asks for under "job", owners, expiry, the result cache, replies under idempotency keys.
ALTER TABLE jobs ADD COLUMN owner TEXT NOT NULL DEFAULT '';
ALTER TABLE jobs ADD COLUMN run_after INTEGER;
ALTER TABLE jobs ADD COLUMN not_before INTEGER;
ALTER TABLE jobs ADD COLUMN deadline INTEGER;
ALTER TABLE jobs ADD COLUMN expires_in_s INTEGER;
ALTER TABLE jobs ADD COLUMN expires_at INTEGER;
ALTER TABLE jobs ADD COLUMN expired INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN webhook_url TEXT;
ALTER TABLE jobs ADD COLUMN webhook_events TEXT;  -- with blanks between
ALTER TABLE jobs ADD COLUMN content_key TEXT;
ALTER TABLE jobs ADD COLUMN revision INTEGER NOT NULL DEFAULT 1;
ALTER TABLE jobs ADD COLUMN rank INTEGER NOT NULL DEFAULT 0;  -- queue::rank_of
UPDATE jobs SET rank = created_at - 60000 * priority;

DROP INDEX jobs_waiting;
CREATE INDEX jobs_waiting ON jobs (suspect, rank, id) WHERE state = 'queued' AND not_before IS NULL;
CREATE INDEX jobs_delayed ON jobs (not_before) WHERE not_before IS NOT NULL;
CREATE INDEX jobs_by_deadline ON jobs (deadline) WHERE state = 'queued' AND deadline IS NOT NULL;
CREATE INDEX jobs_expiring ON jobs (expires_at) WHERE ended_at IS NOT NULL AND expired = 0 AND expires_at IS NOT NULL;
CREATE INDEX jobs_expired ON jobs (expires_at) WHERE expired = 1;
CREATE INDEX jobs_by_content ON jobs (content_key, id)
  WHERE content_key IS NOT NULL AND state = 'succeeded' AND expired = 0;

CREATE TABLE replies (
  owner TEXT NOT NULL,
  route TEXT NOT NULL,
  key TEXT NOT NULL,
  request_sha256 TEXT NOT NULL,
  status INTEGER NOT NULL,
  location TEXT NOT NULL,
  body TEXT NOT NULL,
  expires_at INTEGER NOT NULL,
  PRIMARY KEY (owner, route, key)
) STRICT, WITHOUT ROWID;
CREATE INDEX replies_by_expiry ON replies (expires_at);

-- Kept by triggers, as job_counts.
ALTER TABLE artifacts ADD COLUMN owner TEXT NOT NULL DEFAULT '';
CREATE TABLE owner_use (
  owner TEXT NOT NULL PRIMARY KEY,
  queued_jobs INTEGER NOT NULL,
  artifact_bytes INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
INSERT INTO owner_use SELECT '', (SELECT count(*) FROM jobs WHERE state = 'queued'),
                             (SELECT coalesce(sum(bytes), 0) FROM artifacts);
CREATE TABLE queued_by_priority (priority INTEGER NOT NULL PRIMARY KEY, jobs INTEGER NOT NULL) STRICT;
INSERT INTO queued_by_priority SELECT priority, count(*) FROM jobs WHERE state = 'queued' GROUP BY priority;

CREATE TRIGGER job_came_of AFTER INSERT ON jobs BEGIN
  INSERT INTO owner_use VALUES (new.owner, new.state = 'queued', 0)
    ON CONFLICT DO UPDATE SET queued_jobs = queued_jobs + excluded.queued_jobs;
  INSERT INTO queued_by_priority SELECT new.priority, 1 WHERE new.state = 'queued'
    ON CONFLICT DO UPDATE SET jobs = jobs + 1;
END;
CREATE TRIGGER job_moved_of AFTER UPDATE OF state, priority ON jobs
    WHEN old.state <> new.state OR old.priority <> new.priority BEGIN
  UPDATE owner_use SET queued_jobs = queued_jobs + (new.state = 'queued') - (old.state = 'queued')
    WHERE owner = new.owner;
  UPDATE queued_by_priority SET jobs = jobs - 1 WHERE old.state = 'queued' AND priority = old.priority;
  INSERT INTO queued_by_priority SELECT new.priority, 1 WHERE new.state = 'queued'
    ON CONFLICT DO UPDATE SET jobs = jobs + 1;
END;
CREATE TRIGGER job_went_of AFTER DELETE ON jobs WHEN old.state = 'queued' BEGIN
  UPDATE owner_use SET queued_jobs = queued_jobs - 1 WHERE owner = old.owner;
  UPDATE queued_by_priority SET jobs = jobs - 1 WHERE priority = old.priority;
END;
CREATE TRIGGER artifact_came AFTER INSERT ON artifacts BEGIN
  UPDATE owner_use SET artifact_bytes = artifact_bytes + new.bytes WHERE owner = new.owner;
END;
CREATE TRIGGER artifact_went AFTER DELETE ON artifacts BEGIN
  UPDATE owner_use SET artifact_bytes = artifact_bytes - old.bytes WHERE owner = old.owner;
END;
)sql",
                                                           R"sql(
CREATE TABLE batches (
  id TEXT NOT NULL PRIMARY KEY,
  owner TEXT NOT NULL,
  name TEXT NOT NULL,
  created_at INTEGER NOT NULL,
  max_failed INTEGER,
  size INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
ALTER TABLE jobs ADD COLUMN batch_id TEXT;
ALTER TABLE jobs ADD COLUMN batch_index INTEGER NOT NULL DEFAULT 0;
CREATE INDEX jobs_by_batch ON jobs (batch_id, id) WHERE batch_id IS NOT NULL;
CREATE TRIGGER last_of_batch_went AFTER DELETE ON jobs WHEN old.batch_id IS NOT NULL BEGIN
  DELETE FROM batches WHERE id = old.batch_id AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = old.batch_id);
END;
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
)sql",
                                                           R"sql(
ALTER TABLE jobs ADD COLUMN kind TEXT NOT NULL DEFAULT 'render' CHECK (kind IN ('render', 'measure'));
ALTER TABLE jobs ADD COLUMN accuracy TEXT NOT NULL DEFAULT '';
-- Until when whoever claimed a running job has it.
ALTER TABLE jobs ADD COLUMN lease_until INTEGER;
CREATE INDEX jobs_leased ON jobs (lease_until) WHERE state = 'running' AND lease_until IS NOT NULL;
-- Small jobs are found at once, however many large ones wait before them.
ALTER TABLE jobs ADD COLUMN large INTEGER NOT NULL DEFAULT 0;
CREATE INDEX small_jobs_waiting ON jobs (suspect, rank, id)
  WHERE state = 'queued' AND not_before IS NULL AND large = 0;
)sql",
                                                           R"sql(
-- Images too small for a file of their own, named by `artifacts`. With rowids: large rows, appended.
CREATE TABLE small_images (sha256 TEXT NOT NULL PRIMARY KEY, bytes BLOB NOT NULL) STRICT;
)sql"};

std::int64_t user_version(Database& database) {
  Query query = database.query("PRAGMA user_version");
  query.row();
  return query.integer(0);
}

}  // namespace

void prepare_file(Database& database, const std::string& path, std::int64_t version) {
  const std::int64_t found = user_version(database);
  if (found > schema_version) {
    throw StoreFailure(StoreFailure::Kind::unavailable,
                       path + " was written by a newer program: its schema has version " + std::to_string(found) +
                           ", this one knows " + std::to_string(schema_version));
  }
  // FULL: with WAL it is what never lost an acknowledged commit at a power cut. The size limit gives the disk back
  // after a burst of large documents.
  database.script(
      "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; PRAGMA cache_size = -8000;"
      "PRAGMA journal_size_limit = 67108864;");
  database.checkpoint_at(1000, 8000);  // 4 MB as SQLite's default; 32 MB, a few large documents
  for (std::int64_t next = found; next < version; ++next) {
    database.script("BEGIN IMMEDIATE;" + std::string(steps[static_cast<std::size_t>(next)]) +
                    "PRAGMA user_version = " + std::to_string(next + 1) + "; COMMIT;");
  }
}

}  // namespace queue::sqlite
