#!/usr/bin/env python3
"""Load of one PostgreSQL server: 1,000 slots on 50 simulated nodes (the daemon's stores, queue and messages; a renderer that
sleeps), then a database of a million jobs. Prints jobs/s claimed and completed, events/s to 100 listeners, the time from submit to claim,
and for each size of the database its bytes and the time of lists and claims. The server syncs each commit.

    tests/bench/cluster_scale.py [--nodes 50] [--slots 20] [--jobs 20000] [--stored 1000000]
"""
import argparse
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.support.postgres import PostgresServer  # pylint: disable=wrong-import-position
from tests.support.whittle import BIN  # pylint: disable=wrong-import-position

# Copies of a job that a node has run, without its triggers; the counts follow. 1 % wait.
COPY = """
SET session_replication_role = replica;
CREATE TEMPORARY TABLE sample AS SELECT * FROM jobs WHERE state = 'succeeded' LIMIT 1;
UPDATE sample SET batch_id = NULL;
INSERT INTO sample SELECT (jsonb_populate_record(sample, changes)).* FROM sample, (VALUES
  (jsonb '{{"state": "failed", "problem_code": "out_of_memory", "problem_detail": "The job needs more memory."}}'),
  ('{{"state": "cancelled"}}'),
  ('{{"state": "queued", "attempt": 0, "fence": 0, "started_at": null, "ended_at": null, "boot_id": null}}')) AS variants (changes);
CREATE TEMPORARY TABLE ids AS SELECT i, format('0190a5b0-%s-7000-8000-%s', lpad(to_hex(i / 65536), 4, '0'), lpad(to_hex(i), 12, '0')) AS id,
  CASE WHEN i % 100 < 92 THEN 'succeeded' WHEN i % 100 < 96 THEN 'failed' WHEN i % 100 < 99 THEN 'cancelled' ELSE 'queued' END AS state
  FROM generate_series(1, {count}) AS i;
INSERT INTO jobs (id, {columns}) SELECT ids.id, {columns} FROM ids JOIN sample USING (state) ORDER BY i;
INSERT INTO documents SELECT id, convert_to(repeat('x', 300), 'UTF8'), NULL FROM ids;
INSERT INTO reports SELECT id, repeat('r', 1200) FROM ids WHERE state = 'succeeded';
INSERT INTO moves SELECT ids.id, revision, at, two.state, attempt, reason, worker FROM ids,
  (SELECT DISTINCT ON (state) * FROM moves WHERE state IN ('running', 'succeeded')) AS two WHERE ids.state <> 'queued';
INSERT INTO artifacts SELECT id, 0, '', 'image.png', 'image/png', md5(id) || md5(id || '2'), 100000 FROM ids WHERE state = 'succeeded';
INSERT INTO stored_artifacts SELECT sha256, bytes, 1 FROM artifacts ON CONFLICT DO NOTHING;
INSERT INTO count_changes (what, owner, priority, amount, work) SELECT state, '', 0, count(*), count(*) FROM ids GROUP BY state;
"""


def insert_jobs(server, database, count):
    """Columns that have the same value in all copies of a state are copied by name."""
    columns = server.sql(database, "SELECT string_agg(attname, ', ' ORDER BY attnum) FROM pg_attribute "
                                   "WHERE attrelid = 'jobs'::regclass AND attnum > 0 AND attname <> 'id'")
    server.sql(database, COPY.format(count=count, columns=columns))
    server.sql(database, "VACUUM ANALYZE")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in (("nodes", 50), ("slots", 20), ("jobs", 20_000), ("stored", 1_000_000)):
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    server = PostgresServer(["fsync=on", "max_connections=400", "shared_buffers=512MB", "max_wal_size=4GB"])
    try:
        database = server.new_database()
        program = [BIN / "cluster_scale", server.uri(database)]
        subprocess.run([*program, "2", "20", "1000"], check=True, stdout=subprocess.DEVNULL)  # for the statistics of the planner
        server.sql(database, "VACUUM ANALYZE")
        subprocess.run([*program, str(options.nodes), str(options.slots), str(options.jobs)], check=True)
        if options.stored:
            insert_jobs(server, database, options.stored)
            size = int(server.sql(database, f"SELECT pg_database_size('{database}')"))
            print(f"{options.stored} more jobs, 1 % of them queued: {size / 1e9:.2f} GB, {size / (options.stored + options.jobs):.0f} bytes each", flush=True)
            subprocess.run([*program, "0", "0", "0"], check=True)
    finally:
        server.close()


if __name__ == "__main__":
    main()
