"""Nodes that share a database: every route works on every node, wherever the job runs."""
import io
import tarfile
import time
import unittest

from tests.cluster.nodes import Cluster
from tests.http.daemon import json_of, long_scene, scene, sha256, wait_until
from tests.http.events_test import Stream
from tests.http.keys_test import new_key
from tests.support.images import read_png

SMALL = scene(32, 24)


class RolesTest(unittest.TestCase):
    """Two nodes for clients, one for renders."""

    @classmethod
    def setUpClass(cls):
        cls.cluster = cls.enterClassContext(Cluster())
        cls.one, cls.other = cls.cluster.node("api"), cls.cluster.node("api")
        cls.worker = cls.cluster.node("worker", "--jobs", "2")
        cls.cluster.wait_for_nodes(3)

    def running(self):
        job = self.one.submit(long_scene())
        self.addCleanup(lambda: self.one.request("POST", f"/v1/jobs/{job}/cancel"))
        self.other.wait_for_state(job, "running")
        return job

    def test_lists_the_nodes(self):
        job = self.running()
        def busy():
            nodes = {node["id"]: node for node in json_of(self.other.get("/v1/nodes"))["items"]}
            return nodes if sum(node["running"] for node in nodes.values()) == 1 else None
        nodes = wait_until(busy, "a running job").values()
        self.assertEqual(sorted((node["role"], node["slots"], node["running"]) for node in nodes),
                         [("api", 0, 0), ("api", 0, 0), ("worker", 2, 1)])
        history = json_of(self.one.get(f"/v1/jobs/{job}/history"))["items"]
        self.assertIn(history[-1]["worker"], [node["id"] for node in nodes if node["role"] == "worker"])
        for node in nodes:
            self.assertLessEqual(node["started_at"], node["seen_at"])

    def test_long_poll_notices_a_change_on_another_node(self):
        job = self.one.submit(scene(job={"run_after": "2100-01-01T00:00:00Z"}))
        etag = self.other.get(f"/v1/jobs/{job}").headers["ETag"]
        with self.other.sent("GET", f"/v1/jobs/{job}?wait=60", headers={"If-None-Match": etag}) as connection:
            changed = self.one.request("PATCH", f"/v1/jobs/{job}", {"name": "renamed"}, headers={
                "If-Match": "*", "Content-Type": "application/merge-patch+json"})
            self.assertEqual(changed.status, 200, changed.body)
            self.assertIn(b"renamed", connection.getresponse().read())
        self.assertEqual(self.other.request("DELETE", f"/v1/jobs/{job}").status, 204)

    def test_events_have_one_order_and_resume_on_another_node(self):
        job = self.one.submit(scene(300, 200, samples=4))
        with Stream(self.one, f"/v1/jobs/{job}/events", 0) as stream:
            seen = [event for event in stream.events() if event["event"] != "progress"]
        self.one.wait_for_end(job)
        for node in (self.one, self.other):
            with Stream(node, f"/v1/jobs/{job}/events", seen[0]["id"]) as stream:
                rest = [(event["id"], event["data"]["state"]) for event in stream.events() if event["event"] != "progress"]
            self.assertEqual([state for _, state in rest], ["running", "succeeded"][-len(rest):])
        with Stream(self.other, "/v1/events", seen[0]["id"]) as stream:  # the stream of an ended job may precede its event
            end = stream.until(lambda event: event["data"].get("id") == job and event["event"] == "done")[-1]["id"]
        after = self.one.submit(SMALL)
        self.one.wait_for_end(after)
        streams = []
        for node in (self.one, self.other):
            with Stream(node, "/v1/events", end) as stream:
                streams.append([(event["id"], event["data"]["state"]) for event in stream.until(
                    lambda event: event["data"].get("id") == after and event["event"] == "done")])
        self.assertEqual(streams[0], streams[1])
        self.assertEqual([state for _, state in streams[0]], ["queued", "running", "succeeded"])
        numbers = [number for number, _ in streams[0]]
        self.assertEqual(numbers, list(range(numbers[0], numbers[0] + 3)))
        with Stream(self.other, "/v1/events", numbers[1]) as stream:
            self.assertEqual(next(stream.events())["id"], numbers[2])

    def test_progress_of_a_job_on_another_node(self):
        job = self.running()
        wait_until(lambda: self.other.job(job)["progress"] > 0, "progress")
        with Stream(self.other, f"/v1/jobs/{job}/events") as stream:
            event = stream.until(lambda event: event["event"] == "progress")[-1]
        self.assertGreater(event["data"]["progress"], 0)

    def test_preview_of_a_job_on_another_node(self):
        job = self.running()
        preview = wait_until(lambda: (reply := self.other.get(f"/v1/jobs/{job}/preview?max=64")).status == 200 and reply, "a preview")
        self.assertEqual(read_png(preview.body).shape[:2], (64, 64))

    def test_every_node_renders_in_one_request_and_has_the_image(self):
        document = scene(160, 120, output={"formats": ["png", "exr"]})
        reply = self.one.request("POST", "/v1/render", document, {"Accept": "image/png"})
        self.assertEqual((reply.status, read_png(reply.body).shape[:2]), (200, (120, 160)))
        path = reply.headers["Content-Location"]
        for node in (self.one, self.other):
            again = node.get(path)
            self.assertEqual((again.status, again.body, again.headers["ETag"]), (200, reply.body, reply.headers["ETag"]))
            self.assertEqual(node.get(path, Range="bytes=10-99").body, reply.body[10:100])
            thumbnail = node.get(path.replace("image.png", "preview") + "?max=40")
            self.assertEqual((thumbnail.status, read_png(thumbnail.body).shape[:2]), (200, (30, 40)))

    def test_cancel_reaches_the_other_node(self):
        job = self.running()
        start = time.monotonic()
        self.assertEqual(self.one.request("POST", f"/v1/jobs/{job}/cancel").status, 202)
        ended = json_of(self.other.get(f"/v1/jobs/{job}?wait=60"))
        print(f"cancel of a job on another node: {(time.monotonic() - start) * 1000:.0f} ms")
        self.assertEqual(ended["state"], "cancelled")

    def test_batches_and_bulk_requests(self):
        batch = {"scene": SMALL, "sweep": {"/camera/fov": [30, 40, 50]}}
        submitted = json_of(self.one.request("POST", "/v1/batches", batch))["id"]
        wait_until(lambda: json_of(self.other.get(f"/v1/batches/{submitted}"))["jobs"]["succeeded"] == 3, "the batch")
        jobs = [job["id"] for job in json_of(self.other.get(f"/v1/jobs?batch={submitted}"))["items"]]
        archive = tarfile.open(fileobj=io.BytesIO(self.one.get(f"/v1/batches/{submitted}/artifacts.tar").body))
        images = {sha256(archive.extractfile(each).read()) for each in archive}
        self.assertEqual(images, {self.other.job(job)["artifacts"][0]["sha256"] for job in jobs})
        retried = json_of(self.other.request("POST", "/v1/jobs/bulk", {"action": "remove", "ids": jobs}))
        self.assertEqual(retried["done"], 3)
        self.assertEqual(self.one.get(f"/v1/jobs/{jobs[0]}").status, 404)


class OwnersTest(unittest.TestCase):
    """Owners on two nodes for clients and two for renders."""

    LIMIT = 30

    def setUp(self):
        self.cluster = self.enterContext(Cluster())
        keys = self.cluster.directory / "keys"
        self.keys = {owner: {"Authorization": f"Bearer {new_key(keys, owner)}"} for owner in ("ann", "bob")}
        self.options = ("--keys", keys, "--key-queued-jobs", str(self.LIMIT))
        self.apis = [self.cluster.node("api", *self.options) for _ in range(2)]

    def submit(self, node, owner, jobs, **changes):
        frames = [{"name": f"{owner} {i}"} for i in range(jobs)]
        return self.apis[node].request("POST", "/v1/batches", {"scene": scene(**changes), "frames": frames}, self.keys[owner])

    def test_share_the_slots_of_all_nodes_equally(self):
        for node, owner in ((0, "ann"), (1, "bob")):
            # Each renders for a tenth of a second: the second node is ready before the first has done all.
            self.assertEqual(self.submit(node, owner, self.LIMIT, width=200, height=150, samples=8).status, 202)
        for _ in range(2):
            self.cluster.node("worker", "--jobs", "2", *self.options)
        wait_until(lambda: self.cluster.sql("SELECT count(*) FROM jobs WHERE ended_at IS NULL") == "0", "the end of all jobs")
        claims = self.cluster.sql("SELECT owner, worker FROM moves JOIN jobs ON id = job_id WHERE moves.state = 'running' "
                                  "ORDER BY at, job_id").splitlines()
        of_ann = sum(claim.startswith("ann|") for claim in claims[:self.LIMIT])
        print(f"the first {self.LIMIT} claims of two nodes: {of_ann} of one owner, {self.LIMIT - of_ann} of the other")
        # Up to four claims at once, which do not count each other.
        self.assertLessEqual(abs(of_ann - self.LIMIT / 2), 4)
        self.assertEqual(len({claim.partition("|")[2] for claim in claims}), 2, "both nodes render")

    def test_have_one_quota_on_all_nodes(self):
        self.assertEqual(self.submit(0, "ann", self.LIMIT - 1).status, 202)
        refused = self.submit(1, "ann", 2)
        self.assertEqual((refused.status, json_of(refused)["type"]), (429, "urn:whittle:problem:quota_exceeded"))
        self.assertEqual(self.submit(1, "bob", 2).status, 202, "another owner has a quota of its own")
        self.assertEqual(self.submit(1, "ann", 1).status, 202)
        self.assertEqual(self.submit(0, "ann", 1).status, 429)


class LeavingTest(unittest.TestCase):
    def test_a_drained_node_leaves_and_its_jobs_run_elsewhere(self):
        with Cluster() as cluster:
            api, leaving = cluster.node("api"), cluster.node("worker", "--drain-s", "0")
            job = api.start_job()
            cluster.wait_for_nodes(2)
            cluster.node("worker")
            self.assertEqual(leaving.terminate(), 0)
            wait_until(lambda: len(json_of(api.get(f"/v1/jobs/{job}/history"))["items"]) >= 4, "the second claim")
            self.assertEqual((api.job(job)["state"], api.job(job)["attempt"]), ("running", 1))
            self.assertEqual(sorted(node["role"] for node in cluster.wait_for_nodes(2)), ["api", "worker"])

    def test_a_part_of_its_own_needs_a_database(self):
        with Cluster() as cluster:
            cluster.uri = ""
            with self.assertRaises(AssertionError) as failure:
                cluster.node("api")
            self.assertIn("need --database", str(failure.exception))
