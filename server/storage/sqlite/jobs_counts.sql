R"sql(
CREATE TABLE small_artifacts (sha256 TEXT NOT NULL PRIMARY KEY, bytes BLOB NOT NULL) STRICT;

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
CREATE TABLE artifact_total (bytes INTEGER NOT NULL) STRICT;  -- equal artifacts count once
INSERT INTO artifact_total VALUES (0);
CREATE TABLE queued_by_priority (priority INTEGER NOT NULL PRIMARY KEY, jobs INTEGER NOT NULL) STRICT;
CREATE TRIGGER job_inserted AFTER INSERT ON jobs BEGIN
  UPDATE job_counts SET jobs = jobs + 1, work = work + new.work WHERE state = new.state;
  INSERT INTO owner_usage (owner, queued_jobs, running_jobs)
    VALUES (new.owner, new.state = 'queued', new.state = 'running') ON CONFLICT DO UPDATE SET
    queued_jobs = queued_jobs + excluded.queued_jobs, running_jobs = running_jobs + excluded.running_jobs;
  INSERT INTO queued_by_priority SELECT new.priority, 1 WHERE new.state = 'queued'
    ON CONFLICT DO UPDATE SET jobs = jobs + 1;
END;
CREATE TRIGGER job_moved AFTER UPDATE OF state, priority ON jobs
    WHEN old.state <> new.state OR old.priority <> new.priority BEGIN
  UPDATE job_counts SET jobs = jobs - 1, work = work - old.work WHERE state = old.state;
  UPDATE job_counts SET jobs = jobs + 1, work = work + new.work WHERE state = new.state;
  UPDATE owner_usage SET queued_jobs = queued_jobs + (new.state = 'queued') - (old.state = 'queued'),
    running_jobs = running_jobs + (new.state = 'running') - (old.state = 'running') WHERE owner = new.owner;
END;
CREATE TRIGGER queued_job_moved AFTER UPDATE OF state, priority ON jobs
    WHEN (old.state = 'queued' OR new.state = 'queued')
      AND (old.state <> new.state OR old.priority <> new.priority) BEGIN
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
)sql"
