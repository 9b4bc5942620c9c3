R"sql(
CREATE TABLE new_events (
  xid XID8 NOT NULL DEFAULT pg_current_xact_id(),
  seq BIGINT NOT NULL GENERATED ALWAYS AS IDENTITY,
  at BIGINT NOT NULL DEFAULT extract(epoch FROM clock_timestamp()) * 1000,
  state TEXT NOT NULL,
  job_id TEXT NOT NULL,
  kind TEXT NOT NULL,
  name TEXT NOT NULL,
  batch_id TEXT,
  owner TEXT NOT NULL,
  keep BIGINT NOT NULL
) WITH (autovacuum_vacuum_scale_factor = 0, autovacuum_vacuum_threshold = 10000);
CREATE INDEX new_events_by_xid ON new_events (xid);
CREATE TABLE events (
  number BIGINT PRIMARY KEY,
  at BIGINT NOT NULL,
  state TEXT NOT NULL,
  job_id TEXT NOT NULL,
  kind TEXT NOT NULL,
  name TEXT NOT NULL,
  batch_id TEXT,
  owner TEXT NOT NULL,
  keep BIGINT NOT NULL
);
-- The numbers of the latest event and of the latest one that was deleted.
CREATE TABLE numbered (number BIGINT NOT NULL, deleted BIGINT NOT NULL, until XID8 NOT NULL);
INSERT INTO numbered VALUES (0, 0, '0');

CREATE FUNCTION add_event(job jobs, event_state TEXT) RETURNS VOID LANGUAGE sql AS $$
  INSERT INTO new_events (state, job_id, kind, name, batch_id, owner, keep)
  VALUES (event_state, job.id, job.kind, job.name, job.batch_id, job.owner, job.keep)
$$;
CREATE TRIGGER job_inserted_event AFTER INSERT ON jobs FOR EACH ROW EXECUTE FUNCTION add_job_event();
CREATE TRIGGER job_moved_event AFTER UPDATE OF state ON jobs FOR EACH ROW
  WHEN (old.state <> new.state) EXECUTE FUNCTION add_job_event();
-- A change by the owner (JobStore::change), the only one of these columns.
CREATE TRIGGER job_changed_event AFTER UPDATE OF name, priority, rank, expires_at ON jobs FOR EACH ROW
  WHEN (old.state = new.state AND new.ended_at IS NULL) EXECUTE FUNCTION add_job_event();

CREATE TABLE nodes (
  id TEXT NOT NULL PRIMARY KEY,
  name TEXT NOT NULL,
  role TEXT NOT NULL,
  version TEXT NOT NULL,
  slots BIGINT NOT NULL,
  running BIGINT NOT NULL,
  started_at BIGINT NOT NULL,
  seen_at BIGINT NOT NULL
);
CREATE UNLOGGED TABLE running_results (
  job_id TEXT NOT NULL,
  name TEXT NOT NULL,
  bytes BYTEA NOT NULL,
  at BIGINT NOT NULL,
  PRIMARY KEY (job_id, name)
);
CREATE INDEX jobs_cancelling ON jobs (boot_id) WHERE state = 'running' AND cancel_requested = 1;
)sql"
