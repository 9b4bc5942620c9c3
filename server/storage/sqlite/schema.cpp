#include "server/storage/sqlite/schema.h"

namespace storage::sqlite {

/// Names are those of api/docs/http.md and server/queue/job.h. Times are milliseconds since 1970 UTC.
const char* const jobs_schema = R"sql(
-- Small rows clustered by id, which is creation order: pages and text searches read neighbours. Large or repeated
-- values have their own tables.
CREATE TABLE jobs (
  id TEXT NOT NULL PRIMARY KEY,
  kind TEXT NOT NULL CHECK (kind IN ('render', 'measure')),
  owner TEXT NOT NULL,
  weight INTEGER NOT NULL CHECK (weight > 0),
  name TEXT NOT NULL,
  batch_id TEXT,
  batch_index INTEGER NOT NULL,
  variation TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
  created_at INTEGER NOT NULL,
  started_at INTEGER,
  ended_at INTEGER,
  moved_at INTEGER NOT NULL,         -- time of the latest move, and its reason: code, a space, detail
  moved_for TEXT NOT NULL DEFAULT '',
  attempt INTEGER NOT NULL CHECK (attempt >= 0),
  max_attempts INTEGER NOT NULL,
  priority INTEGER NOT NULL,
  rank INTEGER NOT NULL,             -- queue::rank_of
  run_after INTEGER,
  not_before INTEGER,
  deadline INTEGER,
  expires_in_s INTEGER,
  expires_at INTEGER,
  expired INTEGER NOT NULL DEFAULT 0,
  webhook_url TEXT,
  webhook_events TEXT,               -- separated by spaces
  keep INTEGER NOT NULL,
  cancel_requested INTEGER NOT NULL,
  suspect INTEGER NOT NULL,
  width INTEGER NOT NULL,
  height INTEGER NOT NULL,
  accuracy TEXT NOT NULL,
  large INTEGER NOT NULL,
  work INTEGER NOT NULL,
  problem_code TEXT,
  problem_detail TEXT,
  artifacts_synced INTEGER NOT NULL DEFAULT 1,
  content_key TEXT,
  use_cache INTEGER NOT NULL,
  revision INTEGER NOT NULL,
  fence INTEGER NOT NULL DEFAULT 0,  -- grows with every claim
  boot_id TEXT,                      -- of the daemon with the latest claim
  lease_until INTEGER                -- end of the latest claim
) STRICT, WITHOUT ROWID;
CREATE INDEX jobs_by_state ON jobs (state, id);
CREATE INDEX jobs_waiting ON jobs (suspect, owner, rank, id, work) WHERE state = 'queued' AND not_before IS NULL;
CREATE INDEX small_jobs_waiting ON jobs (suspect, owner, rank, id)
  WHERE large = 0 AND state = 'queued' AND not_before IS NULL;
CREATE INDEX jobs_delayed ON jobs (not_before, work) WHERE not_before IS NOT NULL;
CREATE INDEX jobs_by_deadline ON jobs (deadline) WHERE state = 'queued' AND deadline IS NOT NULL;
CREATE INDEX jobs_leased ON jobs (lease_until) WHERE state = 'running' AND lease_until IS NOT NULL;
CREATE INDEX jobs_expiring ON jobs (expires_at) WHERE ended_at IS NOT NULL AND expired = 0 AND expires_at IS NOT NULL;
CREATE INDEX jobs_ended ON jobs (state, ended_at) WHERE ended_at IS NOT NULL AND expired = 0;
CREATE INDEX jobs_not_kept ON jobs (ended_at) WHERE keep = 0;
CREATE INDEX jobs_expired ON jobs (expires_at) WHERE expired = 1;
CREATE INDEX jobs_by_content ON jobs (content_key, id)
  WHERE content_key IS NOT NULL AND state = 'succeeded' AND expired = 0;
CREATE INDEX jobs_by_batch ON jobs (batch_id, id, state) WHERE batch_id IS NOT NULL;

-- The scenes that the documents of batches have in common, under the id of the batch.
CREATE TABLE scenes (id TEXT NOT NULL PRIMARY KEY, document BLOB NOT NULL) STRICT;
CREATE TABLE documents (
  job_id TEXT NOT NULL PRIMARY KEY REFERENCES jobs ON DELETE CASCADE,
  document BLOB NOT NULL,              -- a patch where there is a scene
  scene_id TEXT REFERENCES scenes
) STRICT;
CREATE INDEX documents_by_scene ON documents (scene_id) WHERE scene_id IS NOT NULL;
-- The moves of jobs between states, written by a trigger.
CREATE TABLE moves (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  revision INTEGER NOT NULL,
  at INTEGER NOT NULL,
  state TEXT NOT NULL,
  attempt INTEGER NOT NULL,
  reason TEXT NOT NULL,
  worker TEXT,
  PRIMARY KEY (job_id, revision)
) STRICT, WITHOUT ROWID;
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
  owner TEXT NOT NULL,
  name TEXT NOT NULL,
  media_type TEXT NOT NULL,
  sha256 TEXT NOT NULL,
  bytes INTEGER NOT NULL,
  PRIMARY KEY (job_id, position)
) STRICT, WITHOUT ROWID;
CREATE INDEX artifacts_by_sha256 ON artifacts (sha256);
CREATE TABLE small_artifacts (sha256 TEXT NOT NULL PRIMARY KEY, bytes BLOB NOT NULL) STRICT;
CREATE TABLE problem_errors (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  pointer TEXT NOT NULL,
  code TEXT NOT NULL,
  detail TEXT NOT NULL,
  PRIMARY KEY (job_id, position)
) STRICT, WITHOUT ROWID;
-- The uploads that a document names.
CREATE TABLE job_assets (
  job_id TEXT NOT NULL REFERENCES jobs ON DELETE CASCADE,
  position INTEGER NOT NULL,
  sha256 TEXT NOT NULL,
  PRIMARY KEY (job_id, position)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_assets_by_sha256 ON job_assets (sha256);
CREATE TABLE scene_assets (
  sha256 TEXT NOT NULL,
  scene_id TEXT NOT NULL REFERENCES scenes ON DELETE CASCADE,
  PRIMARY KEY (sha256, scene_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX assets_of_scene ON scene_assets (scene_id);
CREATE TABLE batches (
  id TEXT NOT NULL PRIMARY KEY,
  owner TEXT NOT NULL,
  name TEXT NOT NULL,
  sweep TEXT NOT NULL,
  created_at INTEGER NOT NULL,
  max_failed INTEGER,
  size INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
-- First replies under idempotency keys.
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

-- Maintained by triggers, so that limits are checked without counting jobs.
CREATE TABLE job_counts (
  state TEXT NOT NULL PRIMARY KEY,
  jobs INTEGER NOT NULL DEFAULT 0,
  work INTEGER NOT NULL DEFAULT 0
) STRICT, WITHOUT ROWID;
INSERT INTO job_counts (state) VALUES ('queued'), ('running'), ('succeeded'), ('failed'), ('cancelled');
CREATE TABLE owner_usage (
  owner TEXT NOT NULL PRIMARY KEY,
  queued_jobs INTEGER NOT NULL,
  running_jobs INTEGER NOT NULL DEFAULT 0,
  artifact_bytes INTEGER NOT NULL DEFAULT 0,
  pass INTEGER NOT NULL DEFAULT 0    -- see JobTransitions::claim
) STRICT, WITHOUT ROWID;
-- The pass at which the latest claim was made.
CREATE TABLE latest_pass (pass INTEGER NOT NULL) STRICT;
INSERT INTO latest_pass VALUES (0);
CREATE TABLE artifact_total (bytes INTEGER NOT NULL) STRICT;  -- equal artifacts count once
INSERT INTO artifact_total VALUES (0);
CREATE TABLE queued_by_priority (priority INTEGER NOT NULL PRIMARY KEY, jobs INTEGER NOT NULL) STRICT;
CREATE TRIGGER job_inserted AFTER INSERT ON jobs BEGIN
  UPDATE job_counts SET jobs = jobs + 1, work = work + new.work WHERE state = new.state;
  INSERT INTO owner_usage (owner, queued_jobs) VALUES (new.owner, new.state = 'queued')
    ON CONFLICT DO UPDATE SET queued_jobs = queued_jobs + excluded.queued_jobs;
  INSERT INTO queued_by_priority SELECT new.priority, 1 WHERE new.state = 'queued'
    ON CONFLICT DO UPDATE SET jobs = jobs + 1;
END;
CREATE TRIGGER job_moved AFTER UPDATE OF state, priority ON jobs
    WHEN old.state <> new.state OR old.priority <> new.priority BEGIN
  UPDATE job_counts SET jobs = jobs - 1, work = work - old.work WHERE state = old.state;
  UPDATE job_counts SET jobs = jobs + 1, work = work + new.work WHERE state = new.state;
  UPDATE owner_usage SET queued_jobs = queued_jobs + (new.state = 'queued') - (old.state = 'queued'),
    running_jobs = running_jobs + (new.state = 'running') - (old.state = 'running') WHERE owner = new.owner;
  UPDATE queued_by_priority SET jobs = jobs - 1 WHERE old.state = 'queued' AND priority = old.priority;
  INSERT INTO queued_by_priority SELECT new.priority, 1 WHERE new.state = 'queued'
    ON CONFLICT DO UPDATE SET jobs = jobs + 1;
END;
CREATE TRIGGER move_written AFTER UPDATE OF state ON jobs WHEN old.state <> new.state AND new.keep = 1 BEGIN
  INSERT INTO moves VALUES (new.id, new.revision, new.moved_at, new.state, new.attempt, new.moved_for,
    iif(new.state = 'running', new.boot_id, NULL));
END;
CREATE TRIGGER job_deleted AFTER DELETE ON jobs BEGIN
  UPDATE job_counts SET jobs = jobs - 1, work = work - old.work WHERE state = old.state;
  UPDATE owner_usage SET queued_jobs = queued_jobs - (old.state = 'queued') WHERE owner = old.owner;
  UPDATE queued_by_priority SET jobs = jobs - 1 WHERE old.state = 'queued' AND priority = old.priority;
END;
CREATE TRIGGER last_of_batch_deleted AFTER DELETE ON jobs WHEN old.batch_id IS NOT NULL BEGIN
  DELETE FROM batches WHERE id = old.batch_id AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = old.batch_id);
END;
CREATE TRIGGER last_document_of_scene_deleted AFTER DELETE ON documents WHEN old.scene_id IS NOT NULL BEGIN
  DELETE FROM scenes WHERE id = old.scene_id AND NOT EXISTS
    (SELECT 1 FROM documents INDEXED BY documents_by_scene WHERE scene_id = old.scene_id);
END;
CREATE TRIGGER artifact_inserted AFTER INSERT ON artifacts BEGIN
  UPDATE owner_usage SET artifact_bytes = artifact_bytes + new.bytes WHERE owner = new.owner;
  UPDATE artifact_total SET bytes = bytes + new.bytes WHERE 1 =
    (SELECT count(*) FROM (SELECT 1 FROM artifacts WHERE sha256 = new.sha256 LIMIT 2));
END;
CREATE TRIGGER artifact_deleted AFTER DELETE ON artifacts BEGIN
  UPDATE owner_usage SET artifact_bytes = artifact_bytes - old.bytes WHERE owner = old.owner;
  UPDATE artifact_total SET bytes = bytes - old.bytes WHERE NOT EXISTS
    (SELECT 1 FROM artifacts WHERE sha256 = old.sha256);
END;

CREATE TABLE probe (writes INTEGER NOT NULL) STRICT;
INSERT INTO probe VALUES (0);
)sql";

const char* const deliveries_schema = R"sql(
CREATE TABLE subscriptions (
  job_id TEXT NOT NULL PRIMARY KEY,
  url TEXT NOT NULL,
  events TEXT NOT NULL  -- separated by spaces
) STRICT, WITHOUT ROWID;
CREATE TABLE deliveries (
  id TEXT NOT NULL PRIMARY KEY,
  job_id TEXT NOT NULL,
  event TEXT NOT NULL,
  url TEXT NOT NULL,
  host TEXT NOT NULL,  -- queue::host_of(url)
  body TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('pending', 'delivered', 'abandoned')),
  created_at INTEGER NOT NULL,
  next_attempt_at INTEGER CHECK ((next_attempt_at IS NOT NULL) = (state = 'pending'))
) STRICT, WITHOUT ROWID;
CREATE INDEX deliveries_of_job ON deliveries (job_id, id);
CREATE INDEX deliveries_due ON deliveries (host, next_attempt_at, id) WHERE state = 'pending';
CREATE INDEX deliveries_by_age ON deliveries (created_at) WHERE state <> 'pending';
CREATE TABLE attempts (
  delivery_id TEXT NOT NULL REFERENCES deliveries ON DELETE CASCADE,
  number INTEGER NOT NULL,
  at INTEGER NOT NULL,
  duration_ms INTEGER NOT NULL,
  status INTEGER NOT NULL,
  detail TEXT NOT NULL,
  PRIMARY KEY (delivery_id, number)
) STRICT, WITHOUT ROWID;
)sql";

}  // namespace storage::sqlite
