"""POST /v1/measure: time against accuracy in a scene, as a job."""
import csv
import io
import json
import os
import signal
import unittest
import xml.etree.ElementTree

from tests.http.daemon import Daemon, OneDaemon, json_of, scene, wait_until
from tests.support.images import read_png

EXACT = {"parameters": ["samples"], "reference_samples": 16}


def edges(width=24, height=18, **changes):
    """A scene with sampling error: edges and a mirror."""
    objects = [{"type": "sphere", "center": [x, 0.5, 0], "radius": 0.5, "material": {"color": 0.7, "reflection": 0.4}}
               for x in (-0.6, 0.6)]
    return scene(width, height, objects=objects + scene()["objects"][1:], **changes)


def long_measure():
    """A measurement that runs for minutes in small steps."""
    return {"scene": edges(400, 300), "settings": {"parameters": ["samples"], "reference_samples": 4096}}


class Measurements(OneDaemon):
    def post(self, body, **headers):
        headers = {name.replace("_", "-"): value for name, value in headers.items()}
        return self.daemon.request("POST", "/v1/measure", body, headers)

    def measured(self, body):
        reply = self.post(body)
        job = json_of(reply, 202)
        self.assertEqual(reply.headers["Location"], f"/v1/jobs/{job['id']}")
        self.assertEqual((job["kind"], job["measurement"], job["report"]), ("measure", None, None))
        return self.daemon.wait_for_success(job["id"])

    def artifact(self, job, name):
        found = [artifact for artifact in job["artifacts"] if artifact["name"] == name]
        reply = self.daemon.get(found[0]["url"])
        self.assertEqual((reply.status, reply.headers["Content-Type"]), (200, found[0]["media_type"]))
        self.assertEqual(len(reply.body), found[0]["bytes"])
        return reply.body

    def test_finds_points_pareto_front_and_advice(self):
        job = self.measured({"scene": edges(name="edges", job={"labels": {"shot": "7"}})})
        found = job["measurement"]
        self.assertEqual((job["name"], job["labels"], job["progress"], job["report"]), ("edges", {"shot": "7"}, 1, None))
        self.assertEqual((found["width"], found["height"], found["alone"]), (24, 18, True))
        self.assertEqual({point["parameter"] for point in found["points"]}, {"target_error", "samples", "max_depth", "cutoff", "approximate"})
        self.assertTrue(found["pareto_front"] and found["advice"])
        self.assertLess(len(json.dumps(found)), 20_000)

    def test_all_artifacts_agree(self):
        job = self.measured({"scene": edges(), "settings": EXACT})
        points = job["measurement"]["points"]
        self.assertEqual([p["value"] for p in points], ["1", "4", "16", "64"])
        full = json.loads(self.artifact(job, "measure.json"))
        self.assertEqual((full["kind"], full["complete"], full["key"]), ("whittle measurement", True, job["id"]))
        self.assertEqual([(p["seconds"], p["error"], p["claimed"]["estimate"]) for p in full["points"]],
                         [(p["seconds"], p["error"], p["claimed"]) for p in points])
        rows = list(csv.DictReader(io.StringIO(self.artifact(job, "measure.csv").decode())))
        self.assertEqual([row["value"] for row in rows], [p["value"] for p in points])
        self.assertEqual([row["pareto_front"] == "1" for row in rows],
                         [i in job["measurement"]["pareto_front"] for i in range(len(points))])
        root = xml.etree.ElementTree.fromstring(self.artifact(job, "measure.svg"))
        self.assertEqual(root.tag, "{http://www.w3.org/2000/svg}svg")
        svg = self.daemon.get(f"/v1/jobs/{job['id']}/measure.svg")
        self.assertIn("sandbox", svg.headers["Content-Security-Policy"], "a chart runs no scripts")
        chart = self.daemon.get(job["links"]["image"])
        self.assertEqual((chart.headers["Content-Type"], chart.body), ("image/png", self.artifact(job, "measure.png")))
        reply = self.daemon.get(job["links"]["measurement"])
        self.assertEqual((reply.headers["Content-Type"], reply.body), ("application/json", self.artifact(job, "measure.json")))

    def test_the_chart_has_text_although_the_sandbox_hides_fonts(self):
        chart = read_png(self.artifact(self.measured({"scene": edges(), "settings": EXACT}), "measure.png"))
        self.assertEqual(chart.shape, (760, 1200, 3))
        dark = chart.max(axis=2) < 100
        self.assertGreater(dark[:60].sum(), 200, "the title")
        # Boxes in place of letters would have equal rows; rows of letters differ.
        rows = {row.tobytes() for row in dark[:60] if row.any()}
        self.assertGreater(len(rows), 8)

    def test_reports_invalid_settings_and_scenes_with_pointers(self):
        bad = {"scene": edges(image={"width": 0, "height": 5}), "settings": {"parameters": ["speed"], "reference_samples": 1}}
        problem = self.assert_problem(self.post(bad), 422, "bad_scene")
        pointers = {error["pointer"]: error["code"] for error in problem["errors"]}
        self.assertEqual(pointers, {"#/settings/parameters/0": "unknown_value", "#/settings/reference_samples": "out_of_range",
                                    "#/scene/image/width": "out_of_range"})
        textured = edges(background={"environment": {"file": "sha256:" + "0" * 64}})
        problem = self.assert_problem(self.post({"scene": textured}), 422, "bad_scene")
        self.assertEqual((problem["errors"][0]["pointer"], problem["errors"][0]["code"]),
                         ("#/scene/background/environment/file", "bad_asset"))

    def test_reports_parameters_without_effect_on_the_scene(self):
        job = json_of(self.post({"scene": scene(), "settings": {"parameters": ["cutoff"]}}))
        job = self.daemon.wait_for_end(job["id"])
        self.assertEqual((job["state"], job["attempt"], job["problem"]["code"]), ("failed", 1, "bad_scene"))
        self.assertEqual(job["problem"]["errors"][0]["pointer"], "#/settings/parameters")

    def test_repeated_requests_run_once_only_with_an_idempotency_key(self):
        body = {"scene": edges(job={"cache": "use"}), "settings": EXACT}
        first = self.post(body, Idempotency_Key="one")
        again = self.post(body, Idempotency_Key="one")
        self.assertEqual((again.status, again.headers["Idempotent-Replayed"]), (202, "true"))
        self.assertEqual(json_of(again)["id"], json_of(first)["id"])
        self.assert_problem(self.post({**body, "settings": {}}, Idempotency_Key="one"), 422, "idempotency_key_reused")
        self.daemon.wait_for_end(json_of(first)["id"])
        another = self.post(body)
        self.assertEqual((another.status, another.headers["X-Cache"]), (202, None))
        job = json_of(another)
        self.assertNotEqual(job["id"], json_of(first)["id"])
        waited = self.post(body, Prefer="wait=60")
        self.assertEqual((waited.status, json_of(waited)["state"]), (200, "succeeded"))

    def test_shows_the_points_while_it_runs_and_keeps_the_reference(self):
        document = edges(64, 48)
        job_id = json_of(self.post({"scene": document, "settings": {"reference_samples": 64}}))["id"]
        counts = []
        def ended():
            job = self.daemon.job(job_id)
            if job["state"] == "running" and job["measurement"]:
                counts.append(len(job["measurement"]["points"]))
                self.assertLessEqual(set(job["measurement"]["pareto_front"]), set(range(counts[-1])))
            return job if job["state"] == "succeeded" else None
        job = wait_until(ended, "the end")
        self.assertEqual(counts, sorted(counts))
        self.assertGreater(len(set(counts)), 1, "points came one by one")
        self.assertLessEqual(counts[-1], len(job["measurement"]["points"]))
        self.assertEqual(self.artifact(job, "reference.exr")[:4], b"\x76\x2f\x31\x01")


class Interrupted(unittest.TestCase):
    @staticmethod
    def begin(daemon, body):
        job = json_of(daemon.request("POST", "/v1/measure", body))
        wait_until(lambda: daemon.job(job["id"])["progress"] > 0, "a step")
        return job["id"]

    def test_running_measurement_is_cancelled_without_artifacts(self):
        with Daemon() as daemon:
            job_id = self.begin(daemon, long_measure())
            daemon.request("POST", f"/v1/jobs/{job_id}/cancel")
            job = daemon.wait_for_state(job_id, "cancelled")
            self.assertEqual((job["artifacts"], job["measurement"]), ([], None))
            self.assertEqual(daemon.get(f"/v1/jobs/{job_id}/measure.json").status, 404)
            daemon.rendered(scene())  # the worker goes on

    def test_kill_9_of_the_daemon_or_the_worker_loses_no_measurement(self):
        with Daemon() as daemon:
            body = {"scene": edges(160, 120), "settings": {"parameters": ["samples"], "reference_samples": 256}}
            job_id = self.begin(daemon, body)
            daemon.restart()
            wait_until(lambda: daemon.job(job_id)["progress"] > 0, "a step")
            for pid in daemon.worker_pids():
                if daemon.job(job_id)["state"] == "running":
                    os.kill(pid, signal.SIGKILL)
            job = daemon.wait_for_end(job_id)
            self.assertEqual((job["state"], len(job["artifacts"])), ("succeeded", 5), job["problem"])
            self.assertEqual(len(job["measurement"]["points"]), 4)

    def test_reports_jobs_that_ran_at_the_same_time(self):
        with Daemon("--jobs", "2") as daemon:
            body = {"scene": edges(160, 120), "settings": {"parameters": ["samples"], "reference_samples": 1024}}
            job_id = self.begin(daemon, body)
            daemon.rendered(scene())
            self.assertEqual(daemon.job(job_id)["state"], "running")
            self.assertFalse(daemon.wait_for_end(job_id)["measurement"]["alone"])
