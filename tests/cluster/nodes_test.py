"""Nodes that share a database: every route works on every node, wherever the job runs."""
import time
import unittest

from tests.cluster.nodes import Cluster
from tests.http.daemon import json_of, long_scene, scene, wait_until
from tests.http.events_test import Stream
from tests.support.images import read_png

SMALL = scene(32, 24)


class RolesTest(unittest.TestCase):
    """Two nodes for clients, one for renders."""

    @classmethod
    def setUpClass(cls):
        cls.cluster = Cluster()
        cls.addClassCleanup(cls.cluster.__exit__)
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

    def test_long_poll_of_another_node_ends_with_the_job(self):
        job = self.one.submit(scene(400, 300, samples=4))
        ended = json_of(self.other.get(f"/v1/jobs/{job}?wait=60"))
        self.assertEqual(ended["state"], "succeeded")

    def test_long_poll_notices_a_change_on_another_node(self):
        job = self.one.submit(scene(job={"run_after": "2100-01-01T00:00:00Z"}))
        etag = self.other.get(f"/v1/jobs/{job}").headers["ETag"]
        connection = self.other.connection(self.other.port)
        connection.request("GET", f"/v1/jobs/{job}?wait=60", headers={"If-None-Match": etag})
        changed = self.one.request("PATCH", f"/v1/jobs/{job}", {"name": "renamed"}, headers={
            "If-Match": "*", "Content-Type": "application/merge-patch+json"})
        self.assertEqual(changed.status, 200, changed.body)
        self.assertIn(b"renamed", connection.getresponse().read())
        connection.close()
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
        after = self.one.submit(SMALL)
        self.one.wait_for_end(after)
        streams = []
        for node in (self.one, self.other):
            with Stream(node, "/v1/events", rest[-1][0]) as stream:
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
        retried = json_of(self.other.request("POST", "/v1/jobs/bulk", {"action": "remove", "ids": jobs}))
        self.assertEqual(retried["done"], 3)
        self.assertEqual(self.one.get(f"/v1/jobs/{jobs[0]}").status, 404)

    def test_measurements_show_their_results_so_far(self):
        measurement = {"scene": scene(200, 150), "settings": {"parameters": ["samples"], "reference_samples": 256}}
        reply = self.one.request("POST", "/v1/measure", measurement)
        self.assertEqual(reply.status, 202, reply.body)
        job = json_of(reply)["id"]
        ended = self.other.wait_for_end(job)
        self.assertEqual(ended["state"], "succeeded", ended["problem"])


class LeavingTest(unittest.TestCase):
    def test_a_drained_node_leaves_and_its_jobs_run_elsewhere(self):
        with Cluster() as cluster:
            api, leaving = cluster.node("api"), cluster.node("worker", "--drain-s", "0")
            job = api.submit(long_scene())
            api.wait_for_state(job, "running")
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


if __name__ == "__main__":
    unittest.main()
