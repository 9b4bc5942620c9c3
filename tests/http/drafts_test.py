"""Jobs with "keep": false: in no list, removed soon after their end, cancelled when the client of POST /v1/render leaves."""
import contextlib
import sqlite3
import unittest

from tests.http.daemon import Daemon, OneDaemon, json_of, long_scene, scene, wait_until
from tests.support.images import read_png

DRAFT = {"keep": False, "priority": 100}


def rows(daemon):
    """The numbers of rows of jobs, documents and artifacts."""
    with contextlib.closing(sqlite3.connect(f"file:{daemon.data}/whittle.db?mode=ro", uri=True)) as database:
        return [database.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
                for table in ("jobs", "documents", "artifacts", "small_artifacts")]


def jobs(daemon):
    return json_of(daemon.get("/v1/queue"))["jobs"]


def images(daemon):
    return [path for path in daemon.data.glob("??/*") if len(path.name) == 64]


class Drafts(OneDaemon):
    options = ("--jobs", "1")

    def tearDown(self):
        for job in json_of(self.daemon.get("/v1/jobs?limit=200"))["items"]:
            self.daemon.request("POST", f"/v1/jobs/{job['id']}/cancel")
            self.daemon.wait_for_end(job["id"])
            self.daemon.request("DELETE", f"/v1/jobs/{job['id']}")
        wait_until(lambda: rows(self.daemon) == [0, 0, 0, 0], "no rows")
        self.assertEqual(images(self.daemon), [])

    def test_give_their_images_and_leave_nothing(self):
        for size in (16, 400):  # a small image is a row, a large one a file
            reply = self.daemon.request("POST", "/v1/render", scene(size, size, job=DRAFT))
            self.assertEqual((reply.status, read_png(reply.body).shape[:2]), (200, (size, size)))
        self.assertEqual(json_of(self.daemon.get("/v1/jobs"))["items"], [])
        self.assertEqual(json_of(self.daemon.get("/v1/jobs?state=succeeded&q=sphere"))["items"], [])

    def test_can_be_read_for_some_seconds_after_their_end(self):
        job = self.daemon.rendered(scene(job=DRAFT))
        self.assertIs(job["keep"], False)
        self.assertEqual(self.daemon.get(job["links"]["image"]).status, 200)
        wait_until(lambda: self.daemon.get(job["links"]["self"]).status == 404, "its removal")
        self.assert_problem(self.daemon.get(job["links"]["image"]), 404, "job_not_found")

    def test_are_cancelled_when_the_client_leaves(self):
        with self.daemon.sent("POST", "/v1/render", long_scene(job=DRAFT)):
            wait_until(lambda: jobs(self.daemon)["running"] == 1, "the start")
            with self.daemon.sent("POST", "/v1/render", scene(job=DRAFT)):
                wait_until(lambda: jobs(self.daemon)["queued"] == 1, "the second")
            wait_until(lambda: jobs(self.daemon)["queued"] == 0, "the end of the one that waited")
            self.assertEqual(jobs(self.daemon)["running"], 1)
        wait_until(lambda: jobs(self.daemon)["running"] == 0, "the end of the one that ran")
        self.assertEqual(jobs(self.daemon)["succeeded"], 0)

    def test_that_fail_are_removed(self):
        document = scene(job={**DRAFT, "deadline": "2001-01-01T00:00:00Z"})
        self.assert_problem(self.daemon.request("POST", "/v1/render", document), 500, "job_failed")

    def test_of_a_cached_image_do_not_remove_it(self):
        document = scene(300, 200, job={"cache": "use"})
        kept = self.daemon.rendered(document)
        reply = self.daemon.request("POST", "/v1/render", {**document, "job": {**DRAFT, "cache": "use"}})
        self.assertEqual((reply.status, reply.headers["X-Cache"]), (200, "hit"))
        wait_until(lambda: rows(self.daemon)[0] == 1, "the removal of the draft")
        self.assertEqual(self.daemon.get(kept["links"]["image"]).body, reply.body)

    def test_are_not_part_of_a_batch(self):
        for body, pointer in (({"scene": scene(job=DRAFT), "frames": [{}]}, "#/frames/0/job/keep"),
                              ({"scene": scene(), "sweep": {"/job/keep": [True, False]}}, "#/scene/job/keep")):
            problem = self.assert_problem(self.daemon.request("POST", "/v1/batches", body), 422, "bad_scene")
            self.assertEqual([(error["pointer"], error["code"]) for error in problem["errors"]], [(pointer, "unsupported")])


class DraftsOfADaemonThatEnds(unittest.TestCase):
    def test_are_cancelled_at_the_next_start(self):
        with Daemon("--jobs", "1") as daemon:
            running = daemon.start_job(long_scene(job=DRAFT))
            daemon.submit(scene(job=DRAFT))
            kept = daemon.submit(scene())
            daemon.restart()
            self.assertIn(daemon.get(f"/v1/jobs/{running}").status, (200, 404))
            self.assertEqual(daemon.wait_for_end(kept)["state"], "succeeded")
            wait_until(lambda: rows(daemon)[0] == 1, "the removal of the drafts")
            self.assertEqual(jobs(daemon)["succeeded"], 1)
