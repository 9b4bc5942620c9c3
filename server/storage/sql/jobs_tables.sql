R"sql(
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
  formats TEXT NOT NULL,
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
CREATE INDEX jobs_expiring ON jobs (expires_at) WHERE ended_at IS NOT NULL AND expired = 0 AND expires_at IS NOT NULL;
CREATE INDEX jobs_ended ON jobs (state, ended_at) WHERE ended_at IS NOT NULL AND expired = 0;
CREATE INDEX jobs_not_kept ON jobs (ended_at) WHERE keep = 0 AND ended_at IS NOT NULL;
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
-- The pass at which the latest claim was made.
CREATE TABLE latest_pass (pass INTEGER NOT NULL) STRICT;
INSERT INTO latest_pass VALUES (0);
CREATE TABLE probe (writes INTEGER NOT NULL) STRICT;
INSERT INTO probe VALUES (0);
)sql"
