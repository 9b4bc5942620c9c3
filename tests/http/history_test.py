"""GET /v1/jobs/{id}/history: the moves of a job and their reasons."""
import os
import signal
import unittest

from tests.http.daemon import Daemon, json_of, scene, wait_until


class History(unittest.TestCase):
    def moves(self, daemon, job_id):
        reply = daemon.get(f"/v1/jobs/{job_id}/history")
        self.assertEqual(reply.status, 200, reply.body)
        items = json_of(reply)["items"]
        self.assertEqual([item["at"] for item in items], sorted(item["at"] for item in items))
        return [(item["state"], item["attempt"], item["code"]) for item in items]

    def test_of_finished_cached_failed_and_retried_jobs(self):
        with Daemon() as daemon:
            document = scene(job={"cache": "use"})
            done = daemon.wait_for_end(daemon.submit(document))
            self.assertEqual(self.moves(daemon, done["id"]),
                             [("queued", 0, None), ("running", 1, None), ("succeeded", 1, None)])
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
            daemon.kill()
            daemon.start()
            self.assertIn("daemon_ended", [code for _, _, code in self.moves(daemon, job_id)])


if __name__ == "__main__":
    unittest.main()
