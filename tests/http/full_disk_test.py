"""A small disk that is really full, a tmpfs of the test's own: what was accepted ends, what is new is refused with the
reason, and with room all is as before; also when the daemon is killed again and again meanwhile.

Mounting wants root; without it there is nothing to see here.
"""
import contextlib
import os
import pathlib
import random
import shutil
import subprocess
import tempfile
import time
import unittest

from tests.http import kills
from tests.http.daemon import Daemon, OneDaemon, json_of, put, scene, sha256, wait_until

KILLS = int(os.environ.get("WHITTLE_FULL_DISK_KILLS", "10"))
SEED = int(os.environ.get("WHITTLE_SEED", str(random.SystemRandom().randrange(10**9))))


def may_mount():
    with tempfile.TemporaryDirectory() as directory:
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "whittle", directory], capture_output=True, check=False).returncode:
            return False
        subprocess.run(["umount", directory], check=True)
        return True


class Disk(contextlib.AbstractContextManager):
    """A tmpfs; use as a context manager."""

    def __init__(self, size):
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="whittle-full-"))
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "whittle", self.directory], check=True)
        self.data = self.directory / "data"

    def __exit__(self, *_):
        subprocess.run(["umount", "-l", self.directory], check=True)
        self.directory.rmdir()

    def free(self):
        return shutil.disk_usage(self.directory).free

    def fill(self):
        """Fills the disk to the last byte."""
        with open(self.directory / "filler", "ab", buffering=0) as file:
            for size in (1 << 16, 512):
                with contextlib.suppress(OSError):
                    while True:
                        file.write(bytes(size))

    def make_room(self):
        (self.directory / "filler").unlink(missing_ok=True)

    def enlarge(self, size):
        subprocess.run(["mount", "-o", f"remount,size={size}", self.directory], check=True)


def is_ready(daemon):
    return daemon.health("/readyz").status == 200


@unittest.skipUnless(may_mount(), "no tmpfs can be mounted here")
class FullDisk(unittest.TestCase):
    assert_problem = OneDaemon.assert_problem

    def test_refuses_new_work_and_finishes_accepted_jobs(self):
        with Disk("64m") as disk, Daemon("--jobs", "1", data=disk.data) as daemon:
            running = daemon.start_job(scene(500, 400, samples=256, name="runs when it fills"))
            waiting = daemon.submit(scene(name="waits"))
            doomed = daemon.submit(scene(name="cancelled when it is full"))
            answered = daemon.request("POST", "/v1/jobs", scene(), {"Idempotency-Key": "before"})
            disk.fill()
            wait_until(lambda: "disk_full" in daemon.log(), "the ballast to be given up")
            for method, path, body in (("POST", "/v1/jobs", scene()), ("POST", "/v1/render", scene()),
                                       ("POST", "/v1/batches", {"scene": scene(), "frames": [{}]})):
                reply = daemon.request(method, path, body)
                self.assertIn("bytes are free on the disk", self.assert_problem(reply, 503, "disk_full")["detail"])
                self.assertGreater(int(reply.headers["Retry-After"]), 0)
            self.assert_problem(put(daemon, os.urandom(1000)), 503, "disk_full")
            self.assertRegex(json_of(daemon.health("/readyz"), 503)["detail"], r"^disk: \d+ bytes are free on the disk, \d+ are kept")
            status = json_of(daemon.get("/v1/status"))
            self.assertFalse(status["ready"])
            self.assertRegex(status["reason"], r"^disk: \d+ bytes are free")
            self.assertLess(status["disk"]["free_bytes"], status["disk"]["reserve_bytes"])
            again = daemon.request("POST", "/v1/jobs", scene(), {"Idempotency-Key": "before"})
            self.assertEqual((again.status, again.body), (202, answered.body))
            self.assertEqual(daemon.request("POST", f"/v1/jobs/{doomed}/cancel").status, 202)
            self.assertEqual(daemon.request("DELETE", f"/v1/jobs/{doomed}").status, 204)
            self.assertEqual(daemon.wait_for_end(running)["state"], "succeeded", "the ballast was for this")
            self.assertEqual(daemon.job(waiting)["state"], "queued", "nothing is begun")
            disk.make_room()
            self.assertEqual(daemon.wait_for_end(waiting)["state"], "succeeded")
            wait_until(lambda: is_ready(daemon), "ready again")
            daemon.rendered(scene())

    def test_renders_again_an_image_that_could_not_be_stored(self):
        with Disk("64m") as disk, Daemon("--jobs", "1", data=disk.data) as daemon:
            job_id = daemon.start_job(scene(2500, 2000, samples=4, name="large", output={"formats": ["exr"]}))
            disk.fill()
            wait_until(lambda: "attempt_failed" in daemon.log() or daemon.job(job_id)["state"] != "running", "the image")
            disk.make_room()
            job = daemon.wait_for_success(job_id)
            self.assertEqual(sha256(daemon.get(job["artifacts"][0]["url"]).body), job["artifacts"][0]["sha256"])

    def test_starts_on_a_full_disk(self):
        with Disk("64m") as disk, Daemon("--jobs", "1", data=disk.data) as daemon:
            job_id = daemon.start_job()
            daemon.kill()
            disk.fill()
            daemon.start()
            self.assertEqual(daemon.job(job_id)["state"], "queued")
            self.assertEqual(daemon.request("POST", f"/v1/jobs/{job_id}/cancel").status, 202)
            self.assertEqual(daemon.wait_for_end(job_id)["state"], "cancelled")
            disk.make_room()
            wait_until(lambda: is_ready(daemon), "ready")

    def test_repeated_kills_on_a_filling_disk_lose_nothing(self):
        chance = random.Random(SEED)
        print(f"WHITTLE_FULL_DISK_KILLS={KILLS} WHITTLE_SEED={SEED}")
        answered, unanswered, removed, statuses = {}, {}, set(), set()
        with Disk("48m") as disk, Daemon("--jobs", "2", data=disk.data) as daemon:
            for kill in range(KILLS):
                client = kills.Client(daemon, str(kill), chance.randrange(10**9))
                client.start()
                time.sleep(chance.uniform(0.0, 0.5))  # the moment is what is tried, not waited for
                disk.fill()
                time.sleep(chance.uniform(0.0, 1.0))
                if chance.random() < 0.3:
                    disk.make_room()
                daemon.kill()
                client.stop.set()
                client.join()
                answered |= client.answered
                unanswered |= client.unanswered
                removed |= client.removed
                statuses |= client.statuses
                daemon.start()  # half the time on a full disk
                if chance.random() < 0.5:
                    disk.make_room()
            disk.enlarge("256m")  # uploads are kept, and can fill the disk without the filler
            wait_until(lambda: is_ready(daemon), "ready")
            print(f"{len(answered)} accepted, answers {sorted(statuses)}")
            for key, (document, body) in answered.items():
                again = daemon.request("POST", "/v1/jobs", document, {"Idempotency-Key": key})
                self.assertEqual(again.body, body, "answered as the first time")
            for key, document in unanswered.items():  # a refusal loses nothing: the client repeats it
                wait_until(lambda: client.submit(key, document).status in (200, 202), key)  # pylint: disable=cell-var-from-loop
            self.assertLessEqual(statuses | client.statuses, {200, 202, 503})
            kills.check_jobs(self, daemon, answered | client.answered, removed, attempts_max=3)


class Bounds(unittest.TestCase):
    assert_problem = OneDaemon.assert_problem

    def test_limit_the_size_of_all_uploads(self):
        with Daemon("--uploads-bytes", "1000") as daemon:
            self.assertEqual(put(daemon, b"a" * 600).status, 201)
            self.assertIn("uploads_bytes", self.assert_problem(put(daemon, b"b" * 600), 503, "uploads_full")["detail"])
            self.assertEqual(put(daemon, b"a" * 600).status, 200, "what is there needs no room")
            self.assertEqual(put(daemon, b"c" * 400).status, 201)
            self.assertEqual(json_of(daemon.get("/v1/version"))["limits"]["uploads_bytes"], 1000)
            self.assertEqual(daemon.metrics()["whittle_upload_bytes"], 1000)

    def test_limit_the_size_of_all_spooled_bodies(self):
        with Daemon("--spool-bytes", str(1 << 20), "--disk-free-bytes", "0") as daemon:
            self.assertIn("no space for another body", self.assert_problem(put(daemon, b"x" * (3 << 20)), 503, "overloaded")["detail"])

    @unittest.skipUnless(may_mount(), "no tmpfs can be mounted here")
    def test_include_a_configurable_reserve(self):
        with Disk("64m") as disk:
            with Daemon("--disk-free-bytes", "0", data=disk.data) as daemon:
                (disk.directory / "filler").write_bytes(bytes(disk.free() - (4 << 20)))
                daemon.rendered(scene())
                daemon.terminate()
            with Daemon(data=disk.data) as daemon:
                self.assert_problem(daemon.request("POST", "/v1/jobs", scene()), 503, "disk_full")
