#!/usr/bin/env python3
"""How far one PostgreSQL server carries: 1,000 slots on 50 simulated nodes (the daemon's stores, queue and messages; a renderer that
sleeps), then a database of a million jobs. Prints jobs/s claimed and completed, events/s to 100 listeners, the time from submit to claim,
and for each size of the database its bytes and the time of lists and claims. The server syncs each commit.

    tests/bench/cluster_scale.py [--nodes 50] [--slots 20] [--jobs 20000] [--stored 1000000]
"""
import argparse
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.support.postgres import PostgresServer  # pylint: disable=wrong-import-position

BIN = pathlib.Path(os.environ.get("WHITTLE_BIN", pathlib.Path(__file__).resolve().parents[2] / "build/release/bin"))
# Ended jobs as copies of one that a node has run, without its triggers; the counts follow.
COPY = """
SET session_replication_role = replica;
CREATE TEMPORARY TABLE sample AS SELECT * FROM jobs WHERE state = 'succeeded' LIMIT 1;
CREATE TEMPORARY TABLE ids AS SELECT i, format('0190a5b0-%s-7%s-8000-%s', lpad(to_hex(i / 65536), 4, '0'), '000', lpad(to_hex(i), 12, '0')) AS id
  FROM generate_series(1, {count}) AS i;
UPDATE sample SET batch_id = NULL;
INSERT INTO jobs SELECT (jsonb_populate_record(sample, jsonb_build_object('id', ids.id))).* FROM sample, ids;
INSERT INTO documents SELECT id, convert_to(repeat('x', 300), 'UTF8'), NULL FROM ids;
INSERT INTO reports SELECT id, repeat('r', 1200) FROM ids;
INSERT INTO moves SELECT ids.id, revision, at, state, attempt, reason, worker FROM ids,
  (SELECT DISTINCT ON (state) * FROM moves WHERE state IN ('running', 'succeeded')) AS two;
INSERT INTO artifacts SELECT id, 0, '', 'image.png', 'image/png', md5(id) || md5(id || '2'), 100000 FROM ids;
INSERT INTO stored_artifacts SELECT sha256, bytes, 1 FROM artifacts ON CONFLICT DO NOTHING;
INSERT INTO count_changes (what, owner, priority, amount, work) VALUES ('succeeded', '', 0, {count}, {count});
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in (("nodes", 50), ("slots", 20), ("jobs", 20_000), ("stored", 1_000_000)):
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    server = PostgresServer(["fsync=on", "max_connections=400", "shared_buffers=512MB", "max_wal_size=4GB"])
    try:
        database = server.new_database()
        program = [BIN / "cluster_scale", server.uri(database)]
        subprocess.run([*program, str(options.nodes), str(options.slots), str(options.jobs)], check=True)
        if options.stored:
            server.sql(database, COPY.format(count=options.stored))
            server.sql(database, "ANALYZE")
            size = int(server.sql(database, f"SELECT pg_database_size('{database}')"))
            print(f"{options.stored} more jobs: {size / 1e9:.2f} GB, {size / (options.stored + options.jobs):.0f} bytes each", flush=True)
            subprocess.run([*program, "0", "0", "0"], check=True)
    finally:
        server.close()


if __name__ == "__main__":
    main()
