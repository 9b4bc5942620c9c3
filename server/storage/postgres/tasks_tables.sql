R"sql(
CREATE UNLOGGED TABLE tasks (
  job_id TEXT COLLATE "C" NOT NULL REFERENCES jobs ON DELETE CASCADE,
  key TEXT COLLATE "C" NOT NULL,
  position BIGINT GENERATED ALWAYS AS IDENTITY,
  build TEXT COLLATE "C" NOT NULL,
  coordinator TEXT COLLATE "C" NOT NULL,  -- the node that runs the job
  state TEXT COLLATE "C" NOT NULL DEFAULT 'waiting' CHECK (state IN ('waiting', 'claimed', 'done')),
  node TEXT COLLATE "C" NOT NULL DEFAULT '',
  attempt BIGINT NOT NULL DEFAULT 0,
  lease_until BIGINT NOT NULL DEFAULT 0,  -- milliseconds of the server's clock
  part BYTEA NOT NULL,                    -- empty once it is done
  result BYTEA,
  PRIMARY KEY (job_id, key)
);
ALTER TABLE tasks ALTER COLUMN part SET STORAGE EXTERNAL;
ALTER TABLE tasks ALTER COLUMN result SET STORAGE EXTERNAL;
CREATE INDEX tasks_open ON tasks (position) WHERE state <> 'done';
CREATE UNLOGGED TABLE task_helpers (
  node TEXT COLLATE "C" NOT NULL PRIMARY KEY,
  build TEXT COLLATE "C" NOT NULL,
  seen_at BIGINT NOT NULL
);
CREATE FUNCTION clock_ms() RETURNS BIGINT LANGUAGE sql VOLATILE
  RETURN CAST(extract(epoch FROM clock_timestamp()) * 1000 AS BIGINT);
CREATE FUNCTION tasks_of_job_ended() RETURNS TRIGGER LANGUAGE plpgsql AS $$
BEGIN
  DELETE FROM tasks WHERE job_id = new.id;
  RETURN NULL;
END $$;
CREATE TRIGGER tasks_of_job_ended AFTER UPDATE OF state ON jobs FOR EACH ROW
  WHEN (new.state IN ('succeeded', 'failed', 'cancelled')) EXECUTE FUNCTION tasks_of_job_ended();
)sql"
