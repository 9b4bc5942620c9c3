"""Endpoints, statuses and headers of api/docs/http.md: jobs and the service itself."""
import datetime
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import uuid

from tests.http.daemon import BIN, NOBODY, SANITIZED, Daemon, OneDaemon, json_of, long_scene, scene, wait_until
from tests.http.staged_scenes import grid


def peak_bytes(document):
    """Peak memory of the command line while it renders the scene."""
    with tempfile.TemporaryDirectory() as directory:
        path = pathlib.Path(directory, "scene.json")
        path.write_text(json.dumps(document), encoding="utf-8")
        arguments = [BIN / "whittle", "render", path, "-o", f"{directory}/out.png"]
        # Started by a small process, because Linux counts the memory of the parent until exec.
        starter = ("import os, sys; pid = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ); "
                   "_, status, usage = os.wait4(pid, 0); print(usage.ru_maxrss); sys.exit(status != 0)")
        done = subprocess.run([sys.executable, "-c", starter, *arguments], stdout=subprocess.PIPE, check=True)
        return int(done.stdout.split()[-1]) * 1024


class Submitting(OneDaemon):
    def test_answers_202_with_location_and_the_queued_job(self):
        reply = self.daemon.request("POST", "/v1/jobs", scene(
            name="a name", job={"name": "another", "labels": {"shot": "7"}, "priority": 80, "max_attempts": 2}))
        job = json_of(reply, 202)
        self.assertEqual(reply.headers["Location"], f"/v1/jobs/{job['id']}")
        self.assertEqual(uuid.UUID(job["id"]).version, 7)
        self.assertEqual((job["name"], job["labels"], job["priority"], job["max_attempts"], job["image"]),
                         ("another", {"shot": "7"}, 80, 2, {"width": 16, "height": 12}))
        self.assertEqual(job["links"]["self"], reply.headers["Location"])
        self.daemon.wait_for_end(job["id"])

    def test_finishes_with_images_and_a_report(self):
        job = self.finished(output={"formats": ["png", "exr"]})
        self.assertEqual((job["progress"], job["attempt"]), (1, 1))
        self.assertLessEqual(job["created_at"], job["started_at"])
        self.assertLessEqual(job["started_at"], job["ended_at"])
        self.assertEqual([a["name"] for a in job["artifacts"]], ["image.png", "image.exr"])
        self.assertEqual(job["report"]["rays"]["camera"], 16 * 12)
        self.assertEqual(job["report"]["non_finite"], 0)

    def test_solves_for_light_between_surfaces_once_for_all_views(self):
        accuracy = {"model": "global", "target_error": 4, "approximate": {"interreflection": "radiosity"}}
        view = {"position": [2, 2, 4], "look_at": [0, 0.5, 0]}
        reused = [self.finished(accuracy=accuracy, **changes)["report"]["radiosity"]["reused"]
                  for changes in ({}, {"camera": view}, {"background": {"color": [0, 0, 1]}})]
        self.assertEqual(reused, [False, True, False])

    def test_reports_line_and_column_of_invalid_json(self):
        problem = self.assert_problem(self.daemon.request("POST", "/v1/jobs", b'{"version": 1,\n  oops}'), 400, "not_json")
        self.assertRegex(problem["detail"], r"line 2, column 3")

    def test_reports_all_errors_of_a_document(self):
        bad = scene(image={"width": 0, "height": 5}, colour="red", objects=[{"type": "sphere", "radius": -1, "material": "glas"}])
        problem = self.assert_problem(self.daemon.request("POST", "/v1/jobs", bad), 422, "bad_scene")
        self.assertLessEqual({"#/image/width", "#/colour", "#/objects/0/radius", "#/objects/0/material"},
                             {error["pointer"] for error in problem["errors"]})

    def test_refuses_query_parameters(self):
        self.assert_problem(self.daemon.request("POST", "/v1/jobs?wait=5", scene()), 400, "invalid_query")


class Validating(OneDaemon):
    def test_reports_requirements_and_samples_of_a_valid_scene(self):
        verdict = json_of(self.daemon.request("POST", "/v1/jobs/validate", scene(10, 10, samples=4)), 200)
        self.assertEqual((verdict["valid"], verdict["errors"]), (True, []))
        self.assertTrue(verdict["requirements"]["spheres"] and verdict["requirements"]["shadows"])
        self.assertFalse(verdict["requirements"]["refraction"])
        self.assertEqual(set(verdict["reasons"]), {name for name, needed in verdict["requirements"].items() if needed})
        self.assertEqual(verdict["reasons"]["spheres"], "/objects/0")
        self.assertTrue(verdict["global_light"].startswith("adds light between surfaces of "), verdict["global_light"])
        del verdict["estimate"]["seconds"]  # of what this daemon rendered before
        self.assertGreater(verdict["estimate"].pop("proof_rays"), 400)
        self.assertEqual(verdict["estimate"], {"samples": 400, "memory_bytes": 10 * 10 * 40 + 2 * 650})
        reply = self.daemon.request("POST", "/v1/jobs/validate", scene(10, 10, accuracy={"samples": [3, 9]}))
        estimate = json_of(reply)["estimate"]
        self.assertEqual((estimate["samples"], estimate["memory_bytes"]), (300, 10 * 10 * 90 + 2 * 650))

    def test_estimates_seconds_from_earlier_renders(self):
        with Daemon() as daemon:
            def seconds(**changes):
                return json_of(daemon.request("POST", "/v1/jobs/validate", scene(**changes)))["estimate"]["seconds"]
            self.assertIsNone(seconds())
            self.assertEqual(seconds(accuracy={"time_budget_ms": 700}), 0.7)
            job = daemon.wait_for_end(daemon.submit(scene(300, 200, samples=16)))
            started, ended = (datetime.datetime.fromisoformat(job[name]) for name in ("started_at", "ended_at"))
            took = (ended - started).total_seconds()
            self.assertAlmostEqual(seconds(width=300, height=200, samples=16), took, delta=0.001)
            self.assertAlmostEqual(seconds(width=300, height=200, samples=160), 10 * took, delta=0.01 + took / 5)
            self.assertEqual(seconds(width=4000, height=4000, accuracy={"target_error": 0.1, "time_budget_ms": 5}), 0.005)
            daemon.restart()
            self.assertAlmostEqual(seconds(width=300, height=200, samples=16), took, delta=0.001)

    @unittest.skipIf(SANITIZED, "a sanitizer takes memory of its own")
    def test_estimates_memory_close_to_that_of_a_render(self):
        positions, triangles = grid(299)
        mesh = {"type": "mesh", "positions": positions, "triangles": triangles, "material": {}}
        wide = {"image": {"width": 2400, "height": 1600}}
        at_rest = peak_bytes(scene())
        for document in (scene(samples=4, **wide), scene(**wide, accuracy={"target_error": 20}), scene(objects=[mesh])):
            estimate = json_of(self.daemon.request("POST", "/v1/jobs/validate", document))["estimate"]["memory_bytes"]
            taken = peak_bytes(document) - at_rest
            self.assertTrue(0.4 < taken / estimate < 1.1, f"estimated {estimate}, took {taken}")

    def test_reports_the_errors_of_an_invalid_scene_with_200(self):
        verdict = json_of(self.daemon.request("POST", "/v1/jobs/validate", scene(colour="red")), 200)
        self.assertEqual((verdict["valid"], verdict["requirements"], verdict["global_light"], verdict["estimate"]),
                         (False, None, None, None))
        self.assertEqual([error["pointer"] for error in verdict["errors"]], ["#/colour"])

    def test_stores_nothing(self):
        before = json_of(self.daemon.get("/v1/jobs"))
        self.daemon.request("POST", "/v1/jobs/validate", scene())
        self.assertEqual(json_of(self.daemon.get("/v1/jobs")), before)


class OneJob(OneDaemon):
    def test_is_not_found_under_other_ids(self):
        for job_id in (NOBODY, "x", NOBODY.upper(), "..%2e", NOBODY + "0", "%27%20or%201=1"):
            self.assert_problem(self.daemon.get(f"/v1/jobs/{job_id}"), 404, "job_not_found")
            self.assert_problem(self.daemon.request("POST", f"/v1/jobs/{job_id}/cancel"), 404, "job_not_found")
            self.assert_problem(self.daemon.request("DELETE", f"/v1/jobs/{job_id}"), 404, "job_not_found")
            self.assert_problem(self.daemon.get(f"/v1/jobs/{job_id}/image.png"), 404, "job_not_found")


class Service(OneDaemon):
    def test_reports_version_and_every_limit(self):
        version = json_of(self.daemon.get("/v1/version"))
        self.assertRegex(version["version"], r"^\d+\.\d+\.\d+$")
        self.assertTrue(version["build"].startswith(version["version"]))
        for name in ("body_bytes", "pixels", "samples_times_pixels", "objects", "triangles", "lights", "queued_jobs"):
            self.assertIn(name, version["limits"])

    def test_allows_only_the_methods_of_a_route(self):
        for method, path, allowed in (("PUT", "/v1/jobs", "GET, HEAD, POST"), ("GET", "/v1/render", "POST"),
                                      ("POST", "/v1/version", "GET, HEAD"), ("OPTIONS", "/v1/jobs", "GET, HEAD, POST"),
                                      ("PUT", f"/v1/jobs/{NOBODY}", "DELETE, GET, HEAD, PATCH"),
                                      ("DELETE", "/", "GET, HEAD"), ("GET", f"/v1/jobs/{NOBODY}/cancel", "POST")):
            reply = self.daemon.request(method, path)
            self.assert_problem(reply, 405, "method_not_allowed")
            self.assertEqual(reply.headers["Allow"], allowed)

    def test_answers_404_for_other_paths(self):
        for path in ("/v1", "/v1/jobs/", "/v2/jobs", "/v1//jobs", "/etc/passwd", "/../etc/passwd", "/v1/jobs/a/b/c",
                     "/V1/version", "/healthz", "/" + "a" * 2047, "/v1/jobs/" + "a" * 2000 + "/nothing", "/a%22b%C3%A9'{}"):
            self.assert_problem(self.daemon.get(path), 404, "not_found")

    def test_has_a_request_id_in_every_reply_and_log_line(self):
        replies = [self.daemon.get(path) for path in ("/", "/nothing", "/v1/jobs?x=1")]
        ids = [reply.headers["X-Request-Id"] for reply in replies]
        self.assertEqual(len(set(ids)), 3)
        wait_until(lambda: set(ids) <= {row.get("request_id") for row in self.daemon.log_rows()}, "log lines")
        rows = {row.get("request_id"): row for row in self.daemon.log_rows()}
        self.assertEqual([rows[i]["status"] for i in ids], [200, 404, 400])
        self.assertEqual(rows[ids[1]]["problem"], "not_found")

    def test_keeps_the_request_id_of_the_client(self):
        for sent in ("client-7/a.b:c+d=", "x" * 128):
            reply = self.daemon.get("/nothing", X_Request_Id=sent)
            self.assertEqual((reply.headers["X-Request-Id"], json_of(reply)["request_id"]), (sent, sent))
            wait_until(lambda sent=sent: sent in {row.get("request_id") for row in self.daemon.log_rows()}, "the log line")
        for refused in ("", "x" * 129, "two words", 'quo"te', "caf\xe9"):
            self.assertEqual(len(self.daemon.get("/nothing", X_Request_Id=refused).headers["X-Request-Id"]), 36)


class HealthListener(OneDaemon):
    def test_has_the_figures_of_jobs_and_requests(self):
        with Daemon("--jobs", "1") as daemon:
            document = scene(16, 16, accuracy={"target_error": 50}, job={"cache": "use"})
            daemon.rendered(document)
            self.assertEqual(daemon.request("POST", "/v1/jobs", document).status, 200, "cached")
            daemon.get("/v1/nothing")
            long, waiting = daemon.start_job(), daemon.submit(scene())
            wait_until(lambda: daemon.metrics()["whittle_queue_age_seconds"] > 0.2, "the queue to age")
            daemon.request("POST", f"/v1/jobs/{long}/cancel")
            daemon.wait_for_end(waiting)
            expected = {'whittle_jobs_ended_total{state="succeeded"}': 3, 'whittle_jobs_ended_total{state="cancelled"}': 1,
                        "whittle_jobs_submitted_total": 3, "whittle_jobs_from_cache_total": 1, "whittle_job_wait_seconds_count": 3,
                        'whittle_job_run_seconds_bucket{state="succeeded",le="+Inf"}': 2, 'whittle_geometry_total{reused="no"}': 2,
                        'whittle_error_targets_total{met="yes"}': 1, "whittle_error_to_target_ratio_count": 1,
                        'whittle_requests_total{method="POST",route="/v1/jobs",status="202"}': 3,
                        'whittle_requests_total{method="GET",route="",status="404"}': 1,
                        "whittle_event_listeners": 0, "whittle_queue_age_seconds": 0}
            # A job is counted after those who wait for its end have their answer.
            figures = wait_until(lambda: expected.items() <= (found := daemon.metrics()).items() and found, expected)
            self.assertGreaterEqual(figures['whittle_rays_total{kind="camera"}'], 16 * 16 + 16 * 12)
            self.assertGreater(figures["whittle_worker_resident_memory_bytes"], 1 << 20)
            self.assertGreaterEqual(figures["whittle_connections"], 0)
            described = set(re.findall(r"(?m)^# TYPE (\S+)", daemon.health("/metrics").body.decode()))
            for name in figures:
                plain = re.sub(r"\{.*", "", name)
                self.assertTrue({plain, re.sub("_(bucket|sum|count)$", "", plain)} & described, name)

    def test_serves_no_other_routes_and_accepts_no_bodies(self):
        self.assertEqual(self.daemon.health("/v1/jobs").status, 404)
        self.assertEqual(self.daemon.health("/healthz", "POST").status, 405)
        self.assertEqual(self.daemon.request("POST", "/healthz", b"x", port=self.daemon.health_port).status, 413)


class Queue(unittest.TestCase):
    def test_runs_small_jobs_beside_large_ones(self):
        with Daemon("--jobs", "2") as daemon:
            running, waiting = daemon.start_job(), daemon.submit(long_scene())
            daemon.rendered(scene())
            self.assertEqual(daemon.job(running)["state"], "running")
            moves = json_of(daemon.get(f"/v1/jobs/{waiting}/history"))["items"]
            self.assertEqual([move["state"] for move in moves], ["queued"], "it had no slot")
