#include "server/storage/postgres/postgres_schema.h"

#include <utility>
#include <vector>

#include "server/queue/job_store.h"
#include "server/storage/postgres/postgres_database.h"
#include "server/storage/postgres/postgres_task_store.h"
#include "server/storage/sql/tables.h"

namespace storage::postgres {
namespace {

/// Functions that run with every change. Statements inside them are cheaper than calls of other functions.
///
/// number_events() returns -1 where another caller numbers: callers that wait for it would wait for its commit.
constexpr const char* functions = R"sql(
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
  IF tg_op = 'INSERT' AND new.state = 'running' THEN  -- it was claimed as soon as it was queued
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
)sql";

/// Counts and triggers. A counter that every transaction changes would make all of them wait for each other's commit.
/// So each adds its changes as rows of `count_changes`, and add_up_counts() moves those of ended transactions to
/// `counts`. `counted` divides them exactly: of the transactions before pg_snapshot_xmin none runs any more.
constexpr const char* counts_and_triggers = R"sql(
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
)sql";

/// The state that nodes share beside the jobs (queue::ClusterStore). Transactions end in another order than they begin,
/// so a sequence has gaps that are filled later, and a reader would miss events. Triggers therefore write events
/// without a number, in the transaction of the change; number_events() moves those of ended transactions to `events`,
/// one caller at a time. `until` is as `counted`. Of one job, `seq` has the order of the changes, because each locks
/// its row.
constexpr const char* cluster_tables = R"sql(
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
)sql";

/// The tables of storage::sql with the types of PostgreSQL.
std::string with_types(std::string tables) {
  for (const auto& [type, replacement] :
       {std::pair{" INTEGER", " BIGINT"}, {" BLOB", " BYTEA"}, {" TEXT", " TEXT COLLATE \"C\""}}) {
    for (std::size_t at = 0; (at = tables.find(type, at)) != std::string::npos; at += std::string(replacement).size())
      tables.replace(at, std::string(type).size(), replacement);
  }
  return tables;
}

/// The statements from each version to the next, from version 1 on.
const std::vector<std::string>& migrations() {
  static const std::vector<std::string> all{functions};
  return all;
}

constexpr int copying = -1;  // in place of the version

void create(PostgresDatabase& database, int version) {
  database.script(std::string("BEGIN; ") + functions + with_types(sql::jobs_tables) +
                  with_types(sql::deliveries_tables) + with_types(sql::objects_tables) + counts_and_triggers +
                  cluster_tables + tasks_tables +
                  "CREATE TABLE whittle_schema (version INTEGER NOT NULL); INSERT INTO whittle_schema VALUES (" +
                  std::to_string(version) + "); COMMIT");
}

[[noreturn]] void fail(const std::string& what) {
  throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable, "PostgreSQL: " + what);
}

[[noreturn]] void fail_unfinished() {
  fail("the database has an unfinished copy of other data; repeat the command with --copy-to to finish it");
}

/// 0 of a database without tables. Throws where this program does not support it.
int read_version(PostgresDatabase& database) {
  if (database.value("SELECT current_setting('server_version_num')::int >= 150000") != "t")
    fail("version 15 or newer is needed, and the server has " + database.value("SHOW server_version"));
  if (database.value("SHOW server_encoding") != "UTF8") fail("the encoding of the database must be UTF8");
  if (database.value("SELECT to_regclass('whittle_schema') IS NOT NULL") != "t") {
    if (database.value("SELECT to_regclass('jobs') IS NULL") != "t") fail("the database has tables of another program");
    return 0;
  }
  const int found = std::stoi(database.value("SELECT version FROM whittle_schema"));
  if (found > schema_version + 1) {
    fail("the schema has version " + std::to_string(found) + ", this program supports versions up to " +
         std::to_string(schema_version + 1));
  }
  return found;
}

}  // namespace

void prepare_schema(const std::string& dsn) {
  PostgresDatabase database(dsn);
  database.script("SET lock_timeout = 0");  // another node creates the tables
  database.script("SELECT pg_advisory_lock(hashtext('whittle'), hashtext('schema'))");  // until the connection ends
  const int found = read_version(database);
  if (found == 0) return create(database, schema_version);
  if (found == copying) fail_unfinished();
  for (int version = found; version < schema_version; ++version) {
    database.script("BEGIN; " + migrations().at(static_cast<std::size_t>(version) - 1) +
                    "; UPDATE whittle_schema SET version = " + std::to_string(version + 1) + "; COMMIT");
  }
}

void check_schema(const std::string& dsn) {
  PostgresDatabase database(dsn);
  if (read_version(database) == copying) fail_unfinished();
}

void prepare_copy(const std::string& dsn) {
  PostgresDatabase database(dsn);
  database.script("SELECT pg_advisory_lock(hashtext('whittle'), hashtext('schema'))");
  const int found = read_version(database);
  if (found == 0) return create(database, copying);
  if (found != copying) fail("the database has tables already; a copy needs an empty one");
}

void finish_copy(const std::string& dsn) {
  PostgresDatabase(dsn).script("UPDATE whittle_schema SET version = " + std::to_string(schema_version));
}

}  // namespace storage::postgres
