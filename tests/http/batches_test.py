"""Batches: one scene in many variations, submitted, observed, cancelled, retried and downloaded together."""
import io
import tarfile
import unittest

from tests.http.daemon import FAR, Daemon, OneDaemon, json_of, put, scene, sha256, wait_until
from tests.http.events_test import Stream
from tests.http.uploads_test import TILE, textured

PAST = "2001-01-01T00:00:00Z"


class Batches(OneDaemon):
    def submit(self, body, **headers):
        return self.daemon.request("POST", "/v1/batches", body, headers)

    def accepted(self, body):
        reply = self.submit(body)
        batch = json_of(reply, 202)
        self.assertEqual(reply.headers["Location"], batch["links"]["self"])
        return batch

    def batch(self, batch):
        return json_of(self.daemon.get(batch["links"]["self"]))

    def ended(self, batch):
        return wait_until(lambda: (now := self.batch(batch))["links"]["cancel"] is None and now, "the batch's end")

    def jobs(self, batch):
        """Returns the jobs in the order of the batch, which is that of their ids."""
        return self.daemon.jobs(f"&batch={batch['id']}", limit=3)[::-1]

    def test_of_frames_patch_the_scene(self):
        frames = [{}, {"name": "second", "image": {"width": 8}}, {"depth_cue": None, "job": {"labels": {"n": "3"}}}]
        document = scene(name="first", depth_cue={"front": 1, "back": 9})
        batch = self.accepted({"name": "orbit", "scene": document, "frames": frames})
        self.assertEqual((batch["name"], batch["size"], batch["max_failed"]), ("orbit", 3, None))
        self.assertEqual(self.ended(batch)["state"], "succeeded")
        jobs = self.jobs(batch)
        self.assertEqual([job["name"] for job in jobs], ["first", "second", "first"])
        self.assertEqual([job["image"]["width"] for job in jobs], [16, 8, 16])
        self.assertEqual([job["labels"] for job in jobs], [{}, {}, {"n": "3"}])
        self.assertEqual([job["report"]["requirements"]["depth_cue"] for job in jobs], [True, True, False])
        self.assertEqual({job["batch"] for job in jobs}, {batch["id"]})
        self.assertEqual([job["variation"] for job in jobs], [{"index": i, "values": frame} for i, frame in enumerate(frames)])

    def test_keep_the_sweep_in_its_order(self):
        sweep = {"/image/width": [8, 16], "/camera/fov": [30, 40.5], "/name": ["a€", "</script>"]}
        batch = self.accepted({"scene": scene(), "sweep": sweep})
        self.assertEqual((batch["sweep"], list(batch["sweep"]), batch["owner"]), (sweep, list(sweep), None))
        self.assertEqual(self.batch(batch)["sweep"], sweep)
        listed = json_of(self.daemon.get("/v1/batches?limit=1"))["items"][0]
        self.assertEqual((listed["id"], listed["sweep"]), (batch["id"], sweep))
        self.assertEqual(self.jobs(batch)[1]["variation"]["values"], {"/image/width": 8, "/camera/fov": 30, "/name": "</script>"})
        self.assertIsNone(self.accepted({"scene": scene(), "frames": [{}]})["sweep"])
        long = {"/name": [f"{i:0255}" for i in range(80)]}
        self.assertIsNone(self.accepted({"scene": scene(job={"run_after": FAR}), "sweep": long})["sweep"])

    def test_omits_long_variations_from_the_jobs(self):
        lights = [{"type": "point", "position": [i, 6, 5]} for i in range(200)]
        batch = self.accepted({"scene": scene(), "frames": [{"lights": lights}, {"lights": lights[:1]}]})
        values = [job["variation"]["values"] for job in self.jobs(batch)]
        self.assertEqual(values, [None, {"lights": lights[:1]}])
        self.assertIsNone(self.finished()["variation"])

    def test_are_listed_newest_first_and_deleted_with_their_jobs(self):
        ids = [self.accepted({"scene": scene(), "frames": [{}]})["id"] for _ in range(3)]
        first = json_of(self.daemon.get("/v1/batches?limit=2"))
        self.assertEqual([batch["id"] for batch in first["items"]], ids[:0:-1])
        second = json_of(self.daemon.get(f"/v1/batches?limit=1&cursor={first['next_cursor']}"))
        self.assertEqual([batch["id"] for batch in second["items"]], ids[:1])
        self.assert_problem(self.daemon.get("/v1/batches?state=queued"), 400, "invalid_query")
        batch = self.accepted({"scene": scene(), "frames": [{}, {"job": {"run_after": FAR}}]})
        wait_until(lambda: self.batch(batch)["jobs"]["succeeded"] == 1, "one job")
        jobs = self.jobs(batch)
        self.assert_problem(self.daemon.request("DELETE", batch["links"]["self"]), 409, "batch_running")
        self.daemon.request("POST", batch["links"]["cancel"])
        self.assertEqual(self.daemon.request("DELETE", batch["links"]["self"]).status, 204)
        self.assert_problem(self.daemon.request("DELETE", batch["links"]["self"]), 404, "batch_not_found")
        for job in jobs:
            self.assertEqual(self.daemon.get(job["links"]["self"]).status, 404)

    def test_is_fetched_as_one_archive(self):
        batch = self.daemon.finished_batch(scene=scene(output={"formats": ["png", "exr"]}), sweep={"/camera/fov": [30, 40, 50]})
        reply = self.daemon.get(batch["links"]["artifacts"])
        self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, "application/x-tar"))
        with tarfile.open(fileobj=io.BytesIO(reply.body)) as archive:
            self.assertEqual(archive.getnames(), [f"0000{i}.{kind}" for i in range(3) for kind in ("exr", "png")])
            for index, job in enumerate(self.jobs(batch)):
                for artifact in job["artifacts"]:
                    member = archive.extractfile(f"0000{index}.{artifact['name'].split('.', 1)[1]}").read()
                    self.assertEqual(sha256(member), artifact["sha256"])
        self.assertEqual(len(reply.body) % 512, 0)

    def test_is_cancelled_and_retried_as_a_whole(self):
        batch = self.accepted({"scene": scene(job={"run_after": FAR}), "frames": [{}, {}, {"job": {"run_after": None}}]})
        wait_until(lambda: self.batch(batch)["jobs"]["succeeded"] == 1, "the one that may run")
        self.assertEqual((self.batch(batch)["state"], self.batch(batch)["progress"]), ("running", 1 / 3))
        reply = self.daemon.request("POST", batch["links"]["cancel"])
        self.assertEqual((reply.status, json_of(reply)["state"]), (202, "cancelled"))
        self.assertEqual(json_of(reply)["jobs"], {"queued": 0, "running": 0, "succeeded": 1, "failed": 0, "cancelled": 2})
        self.assert_problem(self.daemon.request("POST", batch["links"]["cancel"]), 409, "batch_ended")
        reply = self.daemon.request("POST", json_of(reply)["links"]["retry"])
        self.assertEqual((reply.status, json_of(reply)["jobs"]["queued"]), (202, 2))
        self.assert_problem(self.daemon.request("POST", batch["links"]["self"] + "/retry"), 409, "batch_not_failed")
        self.daemon.request("POST", batch["links"]["cancel"])

    def test_a_retry_publishes_events(self):
        batch = self.accepted({"scene": scene(job={"run_after": FAR}), "frames": [{}, {}]})
        self.daemon.request("POST", batch["links"]["cancel"])
        waiting = {job["id"] for job in self.jobs(batch)}
        with Stream(self.daemon, "/v1/events") as stream:
            self.daemon.request("POST", batch["links"]["self"] + "/retry")
            queued = set()
            for event in stream.events():
                if event["data"]["id"] in waiting and event["data"]["state"] in ("queued", "running"):
                    self.assertEqual(event["data"]["state"] == "queued", event["data"]["id"] not in queued, event)
                    queued.add(event["data"]["id"])
                if queued == waiting:
                    break
        self.daemon.request("POST", batch["links"]["cancel"])

    def test_ends_early_when_too_many_fail(self):
        frames = [{"job": {"deadline": PAST}}] * 2 + [{"job": {"run_after": FAR}}]
        batch = self.daemon.finished_batch(scene=scene(), max_failed=1, frames=frames)
        self.assertEqual((batch["state"], self.jobs(batch)[-1]["state"]), ("failed", "cancelled"))

    def test_reports_errors_with_pointers_and_stores_nothing(self):
        before = json_of(self.daemon.get("/v1/jobs?limit=1"))
        table = [
            ({"scene": scene(), "frames": [{}, {"camera": {"fov": -1}}]}, "#/frames/1/camera/fov", "out_of_range"),
            ({"scene": scene(), "sweep": {"/camera/fov": [40, 300]}}, "#/scene/camera/fov", "out_of_range"),
            ({"scene": scene(), "sweep": {"/camra/fov": [40]}}, "#/sweep/~1camra~1fov", "unknown_reference"),
            ({"scene": scene(), "sweep": {"/objects/7/radius": [1]}}, "#/sweep/~1objects~17~1radius", "unknown_reference"),
            ({"scene": scene(), "sweep": {"camera": [40]}}, "#/sweep/camera", "malformed"),
            ({"scene": scene(), "sweep": {"/camera/fov": []}}, "#/sweep/~1camera~1fov", "wrong_length"),
            ({"scene": scene(), "sweep": {"/camera/fov": 40}}, "#/sweep/~1camera~1fov", "wrong_type"),
            ({"scene": scene(), "sweep": {}}, "#/sweep", "wrong_length"),
            ({"scene": scene(), "frames": []}, "#/frames", "wrong_length"),
            ({"scene": scene(), "frames": [7]}, "#/frames/0", "wrong_type"),
            ({"scene": scene(), "frames": [{}] * 10001}, "#/frames", "limit_exceeded"),
            ({"scene": scene(), "sweep": {"/a": [1] * 1000, "/b": [1] * 1000}}, "#/sweep", "limit_exceeded"),
            ({"scene": scene(), "frames": [{}], "sweep": {"/a": [1]}}, "#/sweep", "conflict"),
            ({"scene": scene()}, "#/frames", "missing_field"),
            ({"frames": [{}]}, "#/scene", "missing_field"),
            ({"scene": [], "frames": [{}]}, "#/scene", "wrong_type"),
            ({"scene": scene(), "frames": [{}], "max_failed": -1}, "#/max_failed", "out_of_range"),
            ({"scene": scene(), "frames": [{}], "name": 7}, "#/name", "wrong_type"),
            ({"scene": scene(), "frames": [{}], "nmae": ""}, "#/nmae", "unknown_field"),
        ]
        for body, pointer, code in table:
            problem = self.assert_problem(self.submit(body), 422, "bad_scene")
            self.assertIn((pointer, code), [(error["pointer"], error["code"]) for error in problem["errors"]])
        detail = json_of(self.submit(table[1][0]))["errors"][0]["detail"]
        self.assertIn("(with /camera/fov = 300)", detail)
        self.assertEqual(json_of(self.daemon.get("/v1/jobs?limit=1")), before)

    def test_is_cached_like_jobs_submitted_alone(self):
        alone = [scene(name="alone", camera={**scene()["camera"], "fov": fov}, job={"cache": "use"}) for fov in (31, 32)]
        image = self.daemon.rendered(alone[1])["artifacts"][0]["sha256"]
        batch = self.accepted({"scene": scene(name="alone", job={"cache": "use"}), "frames": [{"camera": {"fov": fov}} for fov in (31, 32)]})
        self.assertEqual(batch["jobs"]["succeeded"], 1)
        self.ended(batch)
        self.assertEqual(self.jobs(batch)[1]["artifacts"][0]["sha256"], image)
        self.assertEqual(self.daemon.request("POST", "/v1/jobs", alone[0]).headers["X-Cache"], "hit")

    def test_needs_its_uploads(self):
        body = {"scene": textured(TILE), "frames": [{}, {"camera": {"fov": 30}}]}
        problem = self.assert_problem(self.submit(body), 422, "bad_scene")
        self.assertEqual([error["code"] for error in problem["errors"]], ["bad_asset"])
        put(self.daemon, TILE)
        self.assertEqual(self.daemon.finished_batch(**body)["state"], "succeeded")

    def test_under_the_same_key_is_submitted_once(self):
        body = {"name": "once", "scene": scene(name="once"), "frames": [{}, {}]}
        first, second = (self.submit(body, **{"Idempotency-Key": "batch"}) for _ in range(2))
        self.assertEqual((first.status, first.headers["Idempotent-Replayed"]), (202, None))
        self.assertEqual((second.status, second.body, second.headers["Idempotent-Replayed"]), (202, first.body, "true"))
        self.assertEqual(len(json_of(self.daemon.get("/v1/jobs?q=once"))["items"]), 2)


class Limits(unittest.TestCase):
    def test_apply_to_the_batch_as_a_whole(self):
        waiting = scene(job={"run_after": FAR})
        with Daemon("--queued-jobs", "2", "--batch-jobs", "3", "--batch-bytes", "4096", "--batch-values", "1000") as daemon:
            reply = daemon.request("POST", "/v1/batches", {"scene": waiting, "frames": [{}] * 3})
            self.assertEqual((reply.status, json_of(reply)["type"]), (503, "urn:whittle:problem:queue_full"))
            self.assertEqual(json_of(daemon.get("/v1/jobs"))["items"], [])
            for frames, name in (([{}] * 4, "batch_jobs is 3"),
                                 ([{"job": {"labels": {str(i): "x" * 250 for i in range(8)}}}] * 2, "batch_bytes is 4096"),
                                 ([{"ambient": [1] * 400}] * 3, "batch_values is 1000")):
                reply = daemon.request("POST", "/v1/batches", {"scene": waiting, "frames": frames})
                self.assertEqual(reply.status, 422, reply.body)
                self.assertIn(name, reply.body.decode())
            self.assertEqual(daemon.request("POST", "/v1/batches", {"scene": waiting, "frames": [{}] * 2}).status, 202)

    def test_survive_a_restart(self):
        with Daemon() as daemon:
            body = {"scene": scene(), "max_failed": 0, "frames": [{"job": {"run_after": FAR}}] * 2}
            batch = json_of(daemon.request("POST", "/v1/batches", body))
            daemon.restart()
            self.assertEqual(json_of(daemon.get(batch["links"]["self"])), batch)
