"""A daemon under load whose worker, and itself, are killed again and again: nothing accepted is lost or done wrong.

$WHITTLE_SOAK_S is the time of the killing in seconds (default 300).
"""
import hashlib
import http.client
import json
import os
import pathlib
import random
import signal
import threading
import time
import unittest

from tests.http.daemon import Daemon, scene, wait_until

SECONDS = float(os.environ.get("WHITTLE_SOAK_S", "300"))
IMAGES = 5  # different ones; all jobs for the same one must give the same bytes


class Submitter(threading.Thread):
    """Submits until stopped; keeps what was acknowledged, and only that."""

    def __init__(self, daemon):
        super().__init__()
        self.daemon_under_test, self.stop, self.accepted = daemon, threading.Event(), []

    def run(self):
        while not self.stop.wait(0.01):
            seed = len(self.accepted) % IMAGES
            # A job that kills happen to hit three times is blameless, so it gets more attempts than that.
            document = scene(120, 90, accuracy={"samples": [9, 9], "seed": seed}, job={"max_attempts": 10})
            port = self.daemon_under_test.port
            try:
                reply = self.daemon_under_test.request("POST", "/v1/jobs", document)
            except (OSError, http.client.HTTPException):
                continue  # killed, or not back yet
            if reply.status == 202:
                self.accepted.append((json.loads(reply.body)["id"], seed))
            elif reply.status != 503 and self.daemon_under_test.port == port:
                raise AssertionError(f"submitting answered {reply.status}: {reply.body}")


class Killed(unittest.TestCase):
    def hurt(self, daemon, dice):
        """Kills the worker, the daemon, or ends the daemon as an operator would."""
        fate = dice.random()
        if fate < 0.7:
            for pid in daemon.worker_pids():
                os.kill(pid, signal.SIGKILL)
        elif fate < 0.9:
            daemon.kill()
            daemon.start()
        else:
            self.assertEqual(daemon.terminate(), 0)
            daemon.start()

    def test_for_minutes_it_loses_no_job_and_no_image_and_does_not_grow(self):
        dice = random.Random(1)
        with Daemon("--log-level", "info") as daemon:
            submitter = Submitter(daemon)
            submitter.start()
            try:
                end, kills = time.monotonic() + SECONDS, 0
                while time.monotonic() < end:
                    more = len(submitter.accepted) + dice.randrange(1, 60)
                    wait_until(lambda: len(submitter.accepted) >= more, "submissions to be accepted again")
                    self.hurt(daemon, dice)
                    kills += 1
            finally:
                submitter.stop.set()
                submitter.join()

            digests = {seed: set() for seed in range(IMAGES)}
            for job_id, seed in submitter.accepted:
                job = daemon.wait_for_end(job_id)
                self.assertEqual(job["state"], "succeeded", job["problem"])
                image = daemon.get(job["links"]["image"]).body
                digests[seed].add(hashlib.sha256(image).hexdigest())
            self.assertEqual([len(digest) for digest in digests.values()], [1] * IMAGES)
            self.assertLess(daemon.resident_bytes(), 256 << 20)
            self.assertLess(len(os.listdir(f"/proc/{daemon.process.pid}/fd")), 100)
            self.assertEqual(list((pathlib.Path(daemon.data) / "spool").iterdir()), [])
            print(f"{len(submitter.accepted)} jobs, {kills} kills")


if __name__ == "__main__":
    unittest.main()
