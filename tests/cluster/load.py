"""Submits jobs to nodes that may end at any moment, and checks what became of those that were acknowledged."""
import collections
import http.client
import json
import random
import threading
import time
import uuid

from tests.http.daemon import PATIENCE_S, Daemon, scene, wait_until

# From milliseconds to a second, so that nodes end in the middle of renders.
DOCUMENTS = [scene(48 * size, 36 * size, samples=size, name=f"load {size}") for size in (1, 4, 12)]


def expected_images():
    """The sha256 of the image of each document, from a daemon on its own."""
    with Daemon() as daemon:
        jobs = [daemon.wait_for_end(daemon.submit(document)) for document in DOCUMENTS]
        return [job["artifacts"][0]["sha256"] for job in jobs]


class Load:
    """Threads that submit until `stop`. A request without an answer is repeated under its Idempotency-Key."""

    def __init__(self, nodes, threads=2):
        self.nodes = nodes
        self.acknowledged = {}  # id: index of the document
        self.repeated = 0
        self.ending = threading.Event()
        self.threads = [threading.Thread(target=self.submit_all, args=(random.Random(seed),)) for seed in range(threads)]
        for thread in self.threads:
            thread.start()

    def submit_all(self, choices):
        while not self.ending.is_set():
            document = choices.randrange(len(DOCUMENTS))
            headers = {"Idempotency-Key": str(uuid.uuid4())}
            end = time.monotonic() + PATIENCE_S
            while (job_id := self.submit(choices.choice(self.nodes), DOCUMENTS[document], headers)) is None:
                self.repeated += 1
                time.sleep(0.1)
                if time.monotonic() > end:
                    raise AssertionError("no node accepts a job")
            self.acknowledged[job_id] = document
            time.sleep(0.2)

    @staticmethod
    def submit(node, document, headers):
        try:
            reply = node.request("POST", "/v1/jobs", document, headers)
        except (OSError, http.client.HTTPException):
            return None
        if reply.status not in (200, 202):
            if reply.status not in (500, 503):
                raise AssertionError(reply)
            return None
        return json.loads(reply.body)["id"]

    def stop(self):
        self.ending.set()
        for thread in self.threads:
            thread.join()

    def check(self, test, cluster, expected):
        """All acknowledged jobs end; prints figures."""
        ids = "', '".join(self.acknowledged)
        query = f"SELECT count(*) FROM jobs WHERE id IN ('{ids}') AND ended_at IS NULL"
        while (running := cluster.sql(query)) != "0":  # for as long as it takes: the machine may be slow
            wait_until(lambda before=running: cluster.sql(query) != before, "the end of one more job")
        rows = cluster.sql("SELECT j.id, j.state, j.attempt, a.sha256 FROM jobs j LEFT JOIN artifacts a ON a.job_id = j.id")
        jobs = {row.split("|")[0]: row.split("|")[1:] for row in rows.splitlines()}
        written = collections.Counter(row for row in cluster.sql("SELECT job_id FROM moves WHERE state = 'succeeded'").splitlines())
        claims = cluster.sql("SELECT count(*) FROM moves WHERE state = 'running'")
        lost = [job for job in self.acknowledged if job not in jobs or jobs[job][0] != "succeeded"]
        wrong = [job for job, document in self.acknowledged.items() if job in jobs and jobs[job][2] != expected[document]]
        twice = [job for job, count in written.items() if count > 1]
        counted = [job for job in self.acknowledged if job in jobs and jobs[job][1] != "1"]
        print(f"{len(self.acknowledged)} acknowledged, {self.repeated} requests repeated, {claims} claims; lost {len(lost)}, "
              f"written twice {len(twice)}, wrong images {len(wrong)}, attempts counted {len(counted)}", flush=True)
        test.assertEqual((lost, twice, wrong, counted), ([], [], [], []))
        test.assertGreater(len(self.acknowledged), 0)
