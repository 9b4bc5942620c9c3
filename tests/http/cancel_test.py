"""Cancels of running jobs, at random moments of renders of many kinds: each is cancelled or was done before, and what waits
behind it runs at once and at no cost.
"""
import random
import unittest

from tests.http.daemon import Daemon, scene, wait_until
from tests.http.staged_scenes import staged_scenes


class Cancelling(unittest.TestCase):
    def test_stops_any_render_at_any_moment(self):
        chance = random.Random(7)
        with Daemon("--jobs", "2") as daemon:
            bodies = list(staged_scenes(daemon).values())
            ends = {"cancelled": 0, "succeeded": 0}
            for _ in range(4):
                for body in bodies:
                    neighbour = daemon.submit(scene(name="neighbour"))
                    job_id = daemon.submit(body)
                    wait_until(lambda job_id=job_id: daemon.job(job_id)["state"] != "queued", "its start")
                    wait_until(lambda: chance.random() < 0.5, "luck")
                    status = daemon.request("POST", f"/v1/jobs/{job_id}/cancel").status
                    job = daemon.wait_for_end(job_id)
                    ends[job["state"]] += 1
                    self.assertIn((status, job["state"]), ((202, "cancelled"), (202, "succeeded"), (409, "succeeded")))
                    self.assertEqual(bool(job["links"]["image"]), job["state"] == "succeeded")
                    neighbour = daemon.wait_for_end(neighbour)
                    self.assertEqual((neighbour["state"], neighbour["attempt"]), ("succeeded", 1))
            self.assertGreater(ends["cancelled"], 0, ends)
