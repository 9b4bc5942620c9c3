"""Requests that wait for a job: long polls by ETag, and Prefer: wait."""
import time

from tests.http.daemon import NOBODY, OneDaemon, json_of, scene, wait_until


class Waiting(OneDaemon):
    options = ("--jobs", "1", "--handler-threads", "1")

    def setUp(self):
        self.blocker = self.daemon.start_job()
        self.id = self.daemon.submit(scene())
        self.path = f"/v1/jobs/{self.id}"

    def tearDown(self):
        self.unblock()

    def unblock(self):
        self.daemon.request("POST", f"/v1/jobs/{self.blocker}/cancel")

    def test_a_long_poll_is_answered_when_the_job_changes(self):
        etag = self.daemon.get(self.path).headers["ETag"]
        self.assertTrue(etag.startswith('W/"'), "the clock alone changes a job's eta")
        answer = self.daemon.in_background("GET", self.path + "?wait=60", None, {"If-None-Match": etag})
        self.assertEqual(self.daemon.get("/v1/version").status, 200)  # the one handler thread is free
        self.assertFalse(answer.done())
        self.unblock()
        reply = answer.result()
        self.assertEqual(reply.status, 200)
        self.assertNotEqual(reply.headers["ETag"], etag)
        self.assertIn(json_of(reply)["state"], ("running", "succeeded"))

    def test_a_long_poll_without_change_ends_with_304(self):
        etag = self.daemon.get(self.path).headers["ETag"]
        begin = time.monotonic()
        reply = self.daemon.get(self.path + "?wait=1", If_None_Match=etag)
        self.assertEqual((reply.status, reply.body, reply.headers["ETag"]), (304, b"", etag))
        self.assertGreaterEqual(time.monotonic() - begin, 1)

    def test_long_polls_by_etag_reach_the_end_of_the_job(self):
        self.unblock()
        state, etag = "queued", 'W/"0"'
        while state in ("queued", "running"):
            reply = self.daemon.get(self.path + "?wait=60", If_None_Match=etag)
            self.assertEqual(reply.status, 200)
            state, etag = json_of(reply)["state"], reply.headers["ETag"]
        self.assertEqual(state, "succeeded")
        self.assertEqual(self.daemon.get(self.path, If_None_Match=etag).status, 304)

    def test_progress_is_a_change(self):
        path = f"/v1/jobs/{self.blocker}"
        seen = {json_of(self.daemon.get(path))["progress"]}
        etag = self.daemon.get(path).headers["ETag"]
        while len(seen) < 3:
            reply = self.daemon.get(path + "?wait=60", If_None_Match=etag)
            self.assertEqual(reply.status, 200)
            etag = reply.headers["ETag"]
            seen.add(round(json_of(reply)["progress"], 2))

    def test_a_long_poll_without_etag_waits_for_the_end(self):
        reply = self.daemon.get(self.path + "?wait=1")
        self.assertEqual((reply.status, json_of(reply)["state"]), (200, "queued"))
        answer = self.daemon.in_background("GET", self.path + "?wait=60")
        self.unblock()
        self.assertEqual(json_of(answer.result())["state"], "succeeded")

    def test_a_poll_for_a_job_that_is_removed_is_answered(self):
        answer = self.daemon.in_background("GET", self.path + "?wait=60")
        wait_until(lambda: self.daemon.metrics()["whittle_event_listeners"] == 1, "the poll")
        self.daemon.request("DELETE", self.path)
        self.assert_problem(answer.result(), 404, "job_not_found")

    def test_rejects_invalid_waits(self):
        for wait in ("61", "-1", "1.5", "", "x", "1&wait=2"):
            self.assert_problem(self.daemon.get(f"{self.path}?wait={wait}"), 400, "invalid_query")
        self.assert_problem(self.daemon.get(f"/v1/jobs/{NOBODY}?wait=60"), 404, "job_not_found")

    def submit(self, prefer):
        return self.daemon.in_background("POST", "/v1/jobs", scene(name="preferred"), {"Prefer": prefer})

    def test_prefer_wait_replies_with_the_ended_job(self):
        answer = self.submit("respond-async, wait=600")
        wait_until(lambda: json_of(self.daemon.get("/v1/jobs?q=preferred&state=queued"))["items"], "the job")
        self.assertFalse(answer.done())
        self.unblock()
        reply = answer.result()
        job = json_of(reply)
        self.assertEqual((reply.status, job["state"]), (200, "succeeded"))
        self.assertEqual(reply.headers["Content-Location"], job["links"]["self"])
        self.assertEqual(reply.headers["Preference-Applied"], "wait=60")

    def test_prefer_wait_replies_202_at_the_end_of_the_wait(self):
        reply = self.submit('wait="1"; foo').result()
        self.assertEqual((reply.status, reply.headers["Preference-Applied"]), (202, "wait=1"))
        self.assertEqual(reply.headers["Location"], json_of(reply)["links"]["self"])
