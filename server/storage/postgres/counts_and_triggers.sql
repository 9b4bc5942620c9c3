R"sql(
CREATE FUNCTION max(BIGINT, BIGINT) RETURNS BIGINT LANGUAGE sql IMMUTABLE PARALLEL SAFE
  RETURN CASE WHEN $1 IS NULL OR $2 IS NULL THEN NULL ELSE greatest($1, $2) END;
CREATE FUNCTION instr(TEXT, TEXT) RETURNS INTEGER LANGUAGE sql IMMUTABLE PARALLEL SAFE RETURN strpos($1, $2);

CREATE TABLE owner_usage (owner TEXT COLLATE "C" NOT NULL PRIMARY KEY, pass BIGINT NOT NULL DEFAULT 0);
-- The bytes of artifacts with the same content count once.
CREATE TABLE stored_artifacts (
  sha256 TEXT COLLATE "C" NOT NULL PRIMARY KEY,
  bytes BIGINT NOT NULL,
  names BIGINT NOT NULL
);
-- `what` is a state of jobs, or 'artifacts': the bytes of an owner, or 'stored': those that count once. Only queued
-- jobs have a priority here.
CREATE TABLE counts (
  what TEXT COLLATE "C" NOT NULL,
  owner TEXT COLLATE "C" NOT NULL,
  priority BIGINT NOT NULL,
  amount BIGINT NOT NULL,
  work BIGINT NOT NULL,
  PRIMARY KEY (what, owner, priority)
);
CREATE TABLE count_changes (
  xid XID8 NOT NULL DEFAULT pg_current_xact_id(),
  what TEXT COLLATE "C" NOT NULL,
  owner TEXT COLLATE "C" NOT NULL,
  priority BIGINT NOT NULL,
  amount BIGINT NOT NULL,
  work BIGINT NOT NULL
);
CREATE INDEX count_changes_by_xid ON count_changes (xid);
CREATE TABLE counted (until XID8 NOT NULL);
INSERT INTO counted VALUES ('0');
-- The upper bound makes the planner expect few rows, so that it uses the index, which deleted rows do not slow.
CREATE VIEW current_counts AS
  SELECT what, owner, priority, amount, work FROM counts UNION ALL
  SELECT what, owner, priority, amount, work FROM count_changes
    WHERE xid >= (SELECT until FROM counted) AND xid < XID8 '18446744073709551615';
CREATE VIEW job_counts AS
  SELECT states.state, CAST(coalesce(sum(amount), 0) AS BIGINT) AS jobs, CAST(coalesce(sum(work), 0) AS BIGINT) AS work
  FROM (VALUES ('queued'), ('running'), ('succeeded'), ('failed'), ('cancelled')) AS states (state)
  LEFT JOIN current_counts ON what = states.state GROUP BY states.state;
CREATE VIEW owners AS
  SELECT owner, CAST(coalesce(sum(amount) FILTER (WHERE what = 'queued'), 0) AS BIGINT) AS queued_jobs,
    CAST(coalesce(sum(amount) FILTER (WHERE what = 'running'), 0) AS BIGINT) AS running_jobs,
    CAST(coalesce(sum(amount) FILTER (WHERE what = 'artifacts'), 0) AS BIGINT) AS artifact_bytes, pass
  FROM owner_usage LEFT JOIN current_counts USING (owner) GROUP BY owner, pass;
CREATE VIEW artifact_total AS
  SELECT CAST(coalesce(sum(amount), 0) AS BIGINT) AS bytes FROM current_counts WHERE what = 'stored';
CREATE VIEW queued_by_priority AS
  SELECT priority, CAST(sum(amount) AS BIGINT) AS jobs FROM current_counts WHERE what = 'queued'
  GROUP BY priority HAVING sum(amount) > 0;

CREATE FUNCTION add_up_counts() RETURNS VOID LANGUAGE plpgsql AS $$
DECLARE
  ended XID8 := pg_snapshot_xmin(pg_current_snapshot());
BEGIN
  IF NOT pg_try_advisory_xact_lock(hashtext('whittle'), hashtext('counts')) THEN RETURN; END IF;
  WITH moved AS (DELETE FROM count_changes WHERE xid < ended RETURNING what, owner, priority, amount, work)
  INSERT INTO counts SELECT what, owner, priority, sum(amount), sum(work) FROM moved GROUP BY what, owner, priority
    ON CONFLICT (what, owner, priority) DO UPDATE SET amount = counts.amount + excluded.amount,
      work = counts.work + excluded.work;
  DELETE FROM counts WHERE amount = 0 AND work = 0;
  UPDATE counted SET until = ended WHERE until < ended;
END $$;

CREATE FUNCTION count_job(job jobs, sign BIGINT) RETURNS VOID LANGUAGE sql AS $$
  INSERT INTO count_changes (what, owner, priority, amount, work)
  VALUES (job.state, job.owner, CASE job.state WHEN 'queued' THEN job.priority ELSE 0 END, sign, sign * job.work)
$$;
CREATE FUNCTION job_inserted() RETURNS TRIGGER LANGUAGE plpgsql AS $$
BEGIN
  INSERT INTO owner_usage (owner) VALUES (new.owner) ON CONFLICT DO NOTHING;
  PERFORM count_job(new, 1);
  RETURN NULL;
END $$;
CREATE TRIGGER job_inserted AFTER INSERT ON jobs FOR EACH ROW EXECUTE FUNCTION job_inserted();
CREATE TRIGGER job_moved AFTER UPDATE OF state, priority ON jobs FOR EACH ROW
  WHEN (old.state <> new.state OR old.priority <> new.priority) EXECUTE FUNCTION job_moved();
CREATE FUNCTION job_deleted() RETURNS TRIGGER LANGUAGE plpgsql AS $$
BEGIN
  PERFORM count_job(old, -1);
  IF old.batch_id IS NOT NULL THEN
    -- Two transactions that delete the last two jobs would each see that of the other.
    PERFORM 1 FROM batches WHERE id = old.batch_id FOR UPDATE;
    DELETE FROM batches WHERE id = old.batch_id AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = old.batch_id);
  END IF;
  RETURN NULL;
END $$;
CREATE TRIGGER job_deleted AFTER DELETE ON jobs FOR EACH ROW EXECUTE FUNCTION job_deleted();
CREATE FUNCTION document_deleted() RETURNS TRIGGER LANGUAGE plpgsql AS $$
BEGIN
  PERFORM 1 FROM scenes WHERE id = old.scene_id FOR UPDATE;
  DELETE FROM scenes WHERE id = old.scene_id
    AND NOT EXISTS (SELECT 1 FROM documents WHERE scene_id = old.scene_id);
  RETURN NULL;
END $$;
CREATE TRIGGER document_deleted AFTER DELETE ON documents FOR EACH ROW
  WHEN (old.scene_id IS NOT NULL) EXECUTE FUNCTION document_deleted();
CREATE FUNCTION artifact_inserted() RETURNS TRIGGER LANGUAGE plpgsql AS $$
DECLARE
  named BIGINT;
BEGIN
  INSERT INTO stored_artifacts VALUES (new.sha256, new.bytes, 1)
    ON CONFLICT (sha256) DO UPDATE SET names = stored_artifacts.names + 1 RETURNING names INTO named;
  INSERT INTO count_changes (what, owner, priority, amount, work) VALUES ('artifacts', new.owner, 0, new.bytes, 0);
  IF named = 1 THEN
    INSERT INTO count_changes (what, owner, priority, amount, work) VALUES ('stored', '', 0, new.bytes, 0);
  END IF;
  RETURN NULL;
END $$;
CREATE TRIGGER artifact_inserted AFTER INSERT ON artifacts FOR EACH ROW EXECUTE FUNCTION artifact_inserted();
CREATE FUNCTION artifact_deleted() RETURNS TRIGGER LANGUAGE plpgsql AS $$
DECLARE
  named BIGINT;
BEGIN
  UPDATE stored_artifacts SET names = names - 1 WHERE sha256 = old.sha256 RETURNING names INTO named;
  INSERT INTO count_changes (what, owner, priority, amount, work) VALUES ('artifacts', old.owner, 0, -old.bytes, 0);
  IF named = 0 THEN
    DELETE FROM stored_artifacts WHERE sha256 = old.sha256;
    INSERT INTO count_changes (what, owner, priority, amount, work) VALUES ('stored', '', 0, -old.bytes, 0);
  END IF;
  RETURN NULL;
END $$;
CREATE TRIGGER artifact_deleted AFTER DELETE ON artifacts FOR EACH ROW EXECUTE FUNCTION artifact_deleted();
)sql"
