"""Times of a job (not_before, deadline, expires_at), changes, retries, moves, and the state of the queue."""
import datetime
import os
import signal
import unittest

from tests.http.daemon import FAR, Daemon, OneDaemon, json_of, scene, wait_until


def in_seconds(seconds):
    return (datetime.datetime.now(datetime.timezone.utc) + datetime.timedelta(seconds=seconds)).isoformat()


time_of = datetime.datetime.fromisoformat


class Times(OneDaemon):
    def test_keep_a_job_from_running_early(self):
        late = self.daemon.submit(scene(job={"run_after": in_seconds(3600)}))
        job = self.daemon.wait_for_end(self.daemon.submit(scene(job={"run_after": in_seconds(1.5)})))
        self.assertEqual((job["state"], job["not_before"]), ("succeeded", None))
        self.assertGreaterEqual(time_of(job["started_at"]), time_of(job["run_after"]))
        job = self.daemon.job(late)
        self.assertEqual((job["state"], job["not_before"], job["queue_position"]), ("queued", job["run_after"], None))
        self.daemon.request("POST", f"/v1/jobs/{late}/cancel")

    def test_delete_expired_images(self):
        job = self.finished(job={"expires_in": 3600})
        self.assertEqual(time_of(job["expires_at"]) - time_of(job["ended_at"]), datetime.timedelta(seconds=3600))
        now = {"expires_at": in_seconds(0)}
        self.assertEqual(self.daemon.request("PATCH", job["links"]["self"], now, {"If-Match": "*"}).status, 200)
        after = wait_until(lambda: (now := self.daemon.job(job["id"]))["expired"] and now, "expiry")
        self.assert_problem(self.daemon.get(job["links"]["image"]), 410, "job_expired")
        self.assertEqual((after["state"], after["artifacts"], after["report"]), ("succeeded", [], job["report"]))


class Changing(OneDaemon):
    def change(self, job_id, body, etag="*"):
        return self.daemon.request("PATCH", f"/v1/jobs/{job_id}", body, {"If-Match": etag})

    def test_merges_the_given_fields_into_the_job(self):
        job_id = self.daemon.submit(scene(name="old", job={"run_after": FAR, "labels": {"a": "1", "b": "2"}}))
        reply = self.change(job_id, {"priority": 90, "name": "new", "labels": {"b": None, "c": "3"}, "expires_at": FAR})
        job = json_of(reply, 200)
        self.assertEqual((job["priority"], job["name"], job["labels"], job["expires_at"]),
                         (90, "new", {"a": "1", "c": "3"}, "2099-01-01T00:00:00.000Z"))
        self.assertEqual(reply.headers["ETag"], self.daemon.get(f"/v1/jobs/{job_id}").headers["ETag"])
        job = json_of(self.change(job_id, {"expires_at": None}))
        self.assertEqual((job["priority"], job["labels"], job["expires_at"]), (90, {"a": "1", "c": "3"}, None))

    def test_requires_the_current_revision(self):
        job_id = self.daemon.submit(scene(job={"run_after": FAR}))
        seen = self.daemon.get(f"/v1/jobs/{job_id}").headers["ETag"]
        self.assertEqual(self.change(job_id, {"name": "first"}, seen).status, 200)
        self.assert_problem(self.change(job_id, {"name": "second"}, seen), 412, "precondition_failed")
        self.assert_problem(self.change(job_id, {"name": "third"}, "W/nonsense"), 412, "precondition_failed")
        merge_patch = {"If-Match": "*", "Content-Type": "application/merge-patch+json"}
        reply = self.daemon.request("PATCH", f"/v1/jobs/{job_id}", {"priority": 7}, merge_patch)
        self.assertEqual((reply.status, json_of(reply)["priority"]), (200, 7))
        reply = self.daemon.request("PATCH", f"/v1/jobs/{job_id}", {}, {"If-Match": "*", "Content-Type": "text/plain"})
        self.assertIn("application/json or application/merge-patch+json", self.assert_problem(reply, 415, "unsupported_media_type")["detail"])
        reply = self.daemon.request("PATCH", f"/v1/jobs/{job_id}", {"name": "fourth"})
        self.assert_problem(reply, 428, "precondition_required")
        self.assertEqual(self.daemon.job(job_id)["name"], "first")

    def test_is_independent_of_progress(self):
        job_id = self.daemon.start_job()
        self.addCleanup(self.daemon.request, "POST", f"/v1/jobs/{job_id}/cancel")
        first = self.daemon.get(f"/v1/jobs/{job_id}")
        wait_until(lambda: self.daemon.job(job_id)["progress"] > json_of(first)["progress"] + 0.01, "progress")
        self.assertNotEqual(first.headers["ETag"], self.daemon.get(f"/v1/jobs/{job_id}").headers["ETag"])
        self.assertEqual(self.change(job_id, {"name": "on its way"}, first.headers["ETag"]).status, 200)

    def test_reports_all_errors(self):
        job_id = self.daemon.submit(scene(job={"run_after": FAR}))
        body = {"priority": 101, "labels": {"a": 1}, "expires_at": "soon", "state": "succeeded"}
        problem = self.assert_problem(self.change(job_id, body), 422, "invalid_patch")
        self.assertEqual({(error["pointer"], error["code"]) for error in problem["errors"]},
                         {("#/priority", "out_of_range"), ("#/labels/a", "wrong_type"), ("#/expires_at", "malformed"),
                          ("#/state", "unknown_field")})
        many = {f"label {index}": "" for index in range(40)}
        self.assertEqual(self.change(job_id, {"labels": many}).status, 200)
        more = {f"another {index}": "" for index in range(40)}
        problem = self.assert_problem(self.change(job_id, {"labels": more}), 422, "invalid_patch")
        self.assertIn("80", problem["errors"][0]["detail"])
        self.assertEqual(len(self.daemon.job(job_id)["labels"]), 40)

    def test_rejects_a_priority_for_an_ended_job(self):
        job = self.finished()
        self.assert_problem(self.change(job["id"], {"priority": 1}), 409, "job_ended")
        self.assertEqual(self.change(job["id"], {"name": "later"}).status, 200)


class Retrying(OneDaemon):
    def test_runs_failed_and_cancelled_jobs_again(self):
        failed = self.daemon.wait_for_end(self.daemon.submit(scene(job={"deadline": in_seconds(-1)})))
        self.assertEqual(failed["links"]["retry"], f"/v1/jobs/{failed['id']}/retry")
        reply = self.daemon.request("POST", failed["links"]["retry"])
        self.assertEqual((reply.status, reply.headers["Location"]), (202, failed["links"]["self"]))
        self.assertEqual((json_of(reply)["problem"], json_of(reply)["deadline"]), (None, None))
        job = self.daemon.wait_for_end(failed["id"])
        self.assertEqual((job["state"], job["attempt"], job["problem"]), ("succeeded", 1, None))
        waiting = self.daemon.submit(scene(job={"run_after": FAR}))
        for job_id in (job["id"], waiting):
            self.assert_problem(self.daemon.request("POST", f"/v1/jobs/{job_id}/retry"), 409, "job_not_failed")
        self.assertIsNone(job["links"]["retry"])


class Queue(unittest.TestCase):
    def test_reports_positions_depth_and_age(self):
        with Daemon("--jobs", "1") as daemon:
            daemon.rendered(scene())
            running = daemon.start_job()
            low, high = (daemon.submit(scene(job={"priority": priority})) for priority in (10, 90))
            daemon.submit(scene(job={"run_after": FAR}))
            self.assertEqual([daemon.job(job_id)["queue_position"] for job_id in (running, high, low)], [None, 1, 2])
            queue = json_of(daemon.get("/v1/queue"))
            expected = {"jobs": {"queued": 3, "running": 1, "succeeded": 1, "failed": 0, "cancelled": 0}, "delayed": 1, "running": 1,
                        "queued_by_priority": {"10": 1, "50": 1, "90": 1}}
            self.assertEqual({name: queue[name] for name in expected}, expected)
            self.assertGreater(daemon.job(low)["eta_s"], 1, "the long job is before it")
            wait_until(lambda: json_of(daemon.get("/v1/queue"))["oldest_age_s"] > queue["oldest_age_s"], "age")

    def test_enforces_the_quota_of_each_owner(self):
        with Daemon("--key-queued-jobs", "2", "--key-artifact-bytes", "1") as daemon:
            waiting = [daemon.submit(scene(job={"run_after": FAR})) for _ in range(2)]
            reply = daemon.request("POST", "/v1/jobs", scene())
            self.assertEqual((reply.status, json_of(reply)["type"]), (429, "urn:whittle:problem:quota_exceeded"))
            self.assertIn("2 of your jobs are queued, 1 more would exceed the limit key_queued_jobs, which is 2", json_of(reply)["detail"])
            self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{waiting[0]}").status, 204)
            daemon.rendered(scene())
            problem = json_of(daemon.request("POST", "/v1/jobs", scene()), 429)
            self.assertIn("key_artifact_bytes is 1", problem["detail"])


class History(unittest.TestCase):
    def moves(self, daemon, job_id):
        items = json_of(daemon.get(f"/v1/jobs/{job_id}/history"), 200)["items"]
        self.assertEqual([item["at"] for item in items], sorted(item["at"] for item in items))
        return [(item["state"], item["attempt"], item["code"]) for item in items]

    def test_of_finished_cached_failed_and_retried_jobs(self):
        with Daemon() as daemon:
            document = scene(job={"cache": "use"})
            done = daemon.rendered(document)
            self.assertEqual(self.moves(daemon, done["id"]), [("queued", 0, None), ("running", 1, None), ("succeeded", 1, None)])
            items = json_of(daemon.get(f"/v1/jobs/{done['id']}/history"))["items"]
            self.assertEqual([item["at"] for item in items], [done["created_at"], done["started_at"], done["ended_at"]])
            self.assertRegex(items[1]["worker"], r"^[0-9a-f-]{36}$")
            cached = json_of(daemon.request("POST", "/v1/jobs", document))["id"]
            self.assertEqual(self.moves(daemon, cached), [("succeeded", 0, None)])
            overdue = daemon.wait_for_end(daemon.submit(scene(job={"deadline": "2001-01-01T00:00:00Z"})))["id"]
            daemon.request("POST", f"/v1/jobs/{overdue}/retry")
            daemon.wait_for_state(overdue, "succeeded")
            self.assertEqual(self.moves(daemon, overdue)[:3],
                             [("queued", 0, None), ("failed", 0, "deadline_exceeded"), ("queued", 0, "retry")])
            draft = daemon.submit(scene(job={"keep": False}))
            self.assertEqual(self.moves(daemon, draft), [])
            self.assertEqual(daemon.get("/v1/jobs/../history").status, 404)

    def test_names_the_end_of_a_worker_and_of_the_daemon(self):
        with Daemon("--jobs", "1") as daemon:
            job_id = daemon.start_job()
            os.kill(wait_until(daemon.worker, "the worker"), signal.SIGKILL)
            wait_until(lambda: len(self.moves(daemon, job_id)) >= 4, "the second attempt")
            self.assertEqual(self.moves(daemon, job_id)[2], ("queued", 1, "worker_crashed"))
            detail = json_of(daemon.get(f"/v1/jobs/{job_id}/history"))["items"][2]["detail"]
            self.assertRegex(detail, "worker process .*signal 9")
            daemon.restart()
            self.assertIn("daemon_ended", [code for _, _, code in self.moves(daemon, job_id)])
