R"sql(
CREATE OR REPLACE FUNCTION job_moved() RETURNS TRIGGER LANGUAGE plpgsql AS $$
BEGIN
  INSERT INTO count_changes (what, owner, priority, amount, work) VALUES
    (old.state, old.owner, CASE old.state WHEN 'queued' THEN old.priority ELSE 0 END, -1, -old.work),
    (new.state, new.owner, CASE new.state WHEN 'queued' THEN new.priority ELSE 0 END, 1, new.work);
  IF old.state <> new.state AND new.keep = 1 THEN
    INSERT INTO moves VALUES (new.id, new.revision, new.moved_at, new.state, new.attempt, new.moved_for,
      CASE new.state WHEN 'running' THEN new.boot_id END);
  END IF;
  RETURN NULL;
END $$;
CREATE OR REPLACE FUNCTION add_job_event() RETURNS TRIGGER LANGUAGE plpgsql AS $$
BEGIN
  IF tg_op = 'INSERT' AND new.state = 'running' THEN  -- by a node of an earlier build, which claimed as it queued
    PERFORM add_event(new, 'queued');
  END IF;
  INSERT INTO new_events (state, job_id, kind, name, batch_id, owner, keep)
  VALUES (new.state, new.id, new.kind, new.name, new.batch_id, new.owner, new.keep);
  RETURN NULL;
END $$;
-- Claims of the same moment count as one: if they waited for each other's commit, all claims of an owner would.
CREATE OR REPLACE FUNCTION count_turn(claimed TEXT, turn BIGINT) RETURNS VOID LANGUAGE plpgsql AS $$
BEGIN
  PERFORM FROM latest_pass, owner_usage WHERE owner = claimed FOR UPDATE SKIP LOCKED;
  IF NOT FOUND THEN RETURN; END IF;
  UPDATE latest_pass SET pass = greatest(pass, (SELECT pass FROM owner_usage WHERE owner = claimed));
  UPDATE owner_usage SET pass = (SELECT pass FROM latest_pass) + turn WHERE owner = claimed;
END $$;
CREATE OR REPLACE FUNCTION number_events() RETURNS BIGINT LANGUAGE plpgsql AS $$
DECLARE
  last RECORD;
  ended XID8;
  added BIGINT;
BEGIN
  PERFORM FROM new_events WHERE xid >= (SELECT until FROM numbered) AND xid < XID8 '18446744073709551615' LIMIT 1;
  IF NOT FOUND THEN RETURN 0; END IF;
  IF NOT pg_try_advisory_xact_lock(hashtext('whittle'), hashtext('events')) THEN RETURN -1; END IF;
  PERFORM set_config('synchronous_commit', 'on', TRUE);  -- clients resume at numbers that they have received
  SELECT * INTO last FROM numbered;
  ended := pg_snapshot_xmin(pg_current_snapshot());
  WITH moved AS (
    DELETE FROM new_events WHERE xid >= last.until AND xid < XID8 '18446744073709551615'
    RETURNING seq, at, state, job_id, kind, name, batch_id, owner, keep)
  INSERT INTO events SELECT last.number + row_number() OVER (ORDER BY seq), at, state, job_id, kind, name, batch_id,
    owner, keep FROM moved;
  GET DIAGNOSTICS added = ROW_COUNT;
  last.number := last.number + added;
  IF last.number - last.deleted > 12000 THEN
    DELETE FROM events WHERE number > last.deleted AND number <= last.number - 10000;
    last.deleted := last.number - 10000;
  END IF;
  UPDATE numbered SET number = last.number, deleted = last.deleted, until = greatest(until, ended);
  RETURN added;
END $$;
)sql"
