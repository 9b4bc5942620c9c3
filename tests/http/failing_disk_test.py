"""A disk that fails at each step in turn, of all that a job's life takes: as full (ENOSPC) and as broken (EIO), once and
for a while. Whatever fails, no accepted job is lost, none ends twice, no image is half, a request that was answered is
answered the same again, and with a sound disk everything ends well.

The disk is tests/http/failing_disk.cpp under the daemon. Under a sanitizer there is nothing of it: that wants to be the
first library itself.
"""
import collections
import errno
import http.client
import json
import mmap
import os
import struct
import unittest

from tests.http import kills, webhooks_test
from tests.http.daemon import BIN, FAR, PATIENCE_S, SANITIZED, Daemon, json_of, scene, sha256, wait_until
from tests.support.whittle import temporary_directory

UPLOAD = b"solid none\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n"


class Control:
    """struct Control of failing_disk.cpp."""
    FIELDS = ("steps", "first", "last", "error", "failed")

    def __init__(self, path):
        path.write_bytes(bytes(8 * len(self.FIELDS)))
        with open(path, "r+b") as file:
            self.memory = mmap.mmap(file.fileno(), 0)

    def get(self, field):
        return struct.unpack_from("<q", self.memory, 8 * self.FIELDS.index(field))[0]

    def set(self, **values):
        for field, value in values.items():
            struct.pack_into("<q", self.memory, 8 * self.FIELDS.index(field), value)

    def fail(self, first, last, error):
        """Steps `first` to `last` from now on."""
        self.set(steps=0, failed=0, error=error, last=last, first=first)

    def heal(self):
        self.set(first=0)


class FailingDisk:
    """A daemon on a disk with injected failures, and its replies."""

    def __init__(self, directory, files="", *options):
        """Operations on `files` of the data directory fail, by default on all."""
        self.control = Control(directory / "control")
        data = directory / "data"
        environment = {"LD_PRELOAD": str(BIN / "failing_disk.so"), "FAILING_DISK_PREFIX": f"{data}/{files}",
                       "FAILING_DISK_CONTROL": str(directory / "control")}
        self.daemon = Daemon("--jobs", "1", *options, data=data, environment=environment)
        self.answered = {}  # key: (document, body)
        self.statuses = collections.Counter()
        self.deaths = 0

    def alive_again(self):
        """Asserts that the daemon ended with code 1 after an I/O error, and restarts it."""
        if "disk_io_error" in self.daemon.log():
            status = self.daemon.process.wait(PATIENCE_S)
            assert status == 1, status
            self.deaths += 1
            self.daemon.start()

    def request(self, *arguments):
        """Returns the reply, or None if the daemon ended."""
        try:
            reply = self.daemon.request(*arguments)
        except (OSError, http.client.HTTPException):
            self.daemon.process.wait(PATIENCE_S)
            return None
        self.statuses[reply.status] += 1
        if reply.status >= 500:
            problem = json_of(reply)
            assert reply.status == 503 and reply.headers["Retry-After"], reply.body
            assert problem["type"].rpartition(":")[2] in ("disk_full", "store_unavailable", "draining"), problem
        return reply

    def submit(self, key, document):
        reply = self.request("POST", "/v1/jobs", document, {"Idempotency-Key": key})
        if reply is not None and reply.status == 202:
            if key in self.answered:
                assert self.answered[key][1] == reply.body, (self.answered[key], reply.body)
            self.answered[key] = (document, reply.body)

    def live(self, key, image_seed):
        """All that is written: an upload, a job with a small image and a large one, a job that is cancelled, one that is
        removed."""
        self.request("PUT", f"/v1/assets/{sha256(UPLOAD + key.encode())}", UPLOAD + key.encode())
        self.submit(key, scene(150, 150, accuracy={"samples": [1, 1], "seed": image_seed}, output={"formats": ["png", "exr"]}))
        self.submit(key + "-later", scene(job={"run_after": FAR}))
        if key + "-later" in self.answered:
            job_id = json.loads(self.answered[key + "-later"][1])["id"]
            self.request("POST", f"/v1/jobs/{job_id}/cancel")
        if key in self.answered:
            self.end_of(json.loads(self.answered[key][1])["id"])

    def end_of(self, job_id):
        """Waits until the job has ended, the disk has failed, or the daemon waits for space; returns the job."""
        def ended():
            if self.daemon.process.poll() is not None:
                return True
            reply = self.request("GET", f"/v1/jobs/{job_id}")
            return reply is None or reply.status != 200 or json_of(reply)["state"] not in ("queued", "running") \
                or self.control.get("steps") >= self.control.get("last") > 0 or self.control.get("failed") > 40
        wait_until(ended, f"the end of {job_id}")


@unittest.skipIf(SANITIZED, "a sanitizer's library wants to be the first")
class EachStep(unittest.TestCase):
    def steps_of_a_life(self):
        disk = FailingDisk(temporary_directory(self))
        with disk.daemon:
            disk.control.fail(10**9, 10**9, errno.EIO)  # counts from here
            disk.live("counted", 0)
            self.assertEqual(disk.daemon.wait_for_end(self.id_of(disk, "counted"))["state"], "succeeded")
            return disk.control.get("steps")

    @staticmethod
    def id_of(disk, key):
        return json.loads(disk.answered[key][1])["id"]

    def try_each(self, error, length, every=1):
        steps = self.steps_of_a_life()
        self.assertGreater(steps, 12, "an upload, two jobs and an image are more than that")
        disk = FailingDisk(temporary_directory(self))
        with disk.daemon:
            hit = 0
            for first in range(1, steps + 1, every):
                disk.control.fail(first, first + length - 1, error)
                disk.live(f"step-{first}", first)
                hit += disk.control.get("failed") > 0
                disk.control.heal()
                disk.alive_again()
                disk.live(f"step-{first}", first)  # answered as before, or done now
                disk.alive_again()
            print(f"{os.strerror(error)}, {length} steps long: {steps} steps, {hit} times hit, answers "
                  f"{dict(sorted(disk.statuses.items()))}, begun anew {disk.deaths} times")
            self.assertGreater(hit, steps // every * 3 // 4)
            self.check_end(disk)
            return disk

    def check_end(self, disk):
        daemon, states, images = disk.daemon, collections.Counter(), set()
        for key, (_, body) in disk.answered.items():
            job = daemon.job(json.loads(body)["id"])
            if key.endswith("-later"):
                self.assertIn(job["state"], ("queued", "cancelled"))
                continue
            job = daemon.wait_for_success(job["id"])
            states[job["state"]] += 1
            self.assertEqual(len(job["artifacts"]), 2)
            for artifact in job["artifacts"]:
                self.assertEqual(sha256(daemon.get(artifact["url"]).body), artifact["sha256"])
                images.add(artifact["sha256"])
        self.assertGreater(states["succeeded"], 0)
        known = {json.loads(body)["id"] for _, body in disk.answered.values()}
        listed = {job["id"] for job in daemon.jobs()}
        self.assertEqual(listed, known, "none lost, none that was not acknowledged")
        daemon.terminate()
        daemon.start()  # what could not even be deleted goes now
        kills.check_files(self, daemon)
        self.assertEqual([path.name for path in (daemon.data / "tmp").iterdir()], [])
        kills.check_ends_once(self, daemon)

    def test_on_a_disk_that_is_full_once(self):
        disk = self.try_each(errno.ENOSPC, 1)
        self.assertEqual(disk.deaths, 0, "a full disk ends nothing")

    def test_on_a_disk_that_is_full_for_many_steps(self):
        disk = self.try_each(errno.ENOSPC, 12, every=6)  # results are tried again every half a second: this one takes its time
        self.assertEqual(disk.deaths, 0, "a full disk ends nothing")

    def test_on_a_disk_with_io_errors(self):
        disk = self.try_each(errno.EIO, 1)
        self.assertGreater(disk.deaths, 0, "the daemon begins anew")


@unittest.skipIf(SANITIZED, "a sanitizer's library wants to be the first")
class WebhookStore(unittest.TestCase):
    def test_failure_ends_the_daemon_and_loses_no_delivery(self):
        receiver = self.enterContext(webhooks_test.Receiver())
        directory = temporary_directory(self)
        secret = directory / "secret"
        secret.write_text(webhooks_test.SECRET_TEXT, "ascii")
        disk = FailingDisk(directory, "webhooks.db", "--webhook-secret-file", secret, "--webhook-networks", "127.0.0.0/8")
        with disk.daemon:
            for step in range(1, 13):
                self.break_at(disk, step, scene(job={"webhook": {"url": receiver.url(f"/{step}")}}))
            self.assertGreater(disk.deaths, 8, "most steps are met before the message is out and noted")
            self.assertEqual(len(disk.answered), 12)
            for _, body in disk.answered.values():
                path = f"/v1/jobs/{json.loads(body)['id']}/deliveries"
                wait_until(lambda path=path: [item["state"] for item in json_of(disk.daemon.get(path))["items"]]
                           == ["delivered"], path)
        self.assertEqual({path for path, _, _ in receiver.seen}, {f"/{step}" for step in range(1, 13)})

    def break_at(self, disk, step, document):
        """Submits a job while one write of its delivery fails; repeats the submission if it was refused."""
        disk.control.fail(step, step, errno.EIO)
        disk.submit(f"step-{step}", document)
        if f"step-{step}" in disk.answered:
            path = f"/v1/jobs/{json.loads(disk.answered[f'step-{step}'][1])['id']}/deliveries"

            def over():
                reply = None if disk.control.get("failed") else disk.request("GET", path)
                return reply is None or reply.status != 200 or [item["state"] for item in json_of(reply)["items"]] == ["delivered"]
            wait_until(over, "the message or the failure")
        broken = disk.control.get("failed") > 0
        disk.control.heal()
        if broken:
            wait_until(lambda: "disk_io_error" in disk.daemon.log(), "the failure to be logged")
            disk.alive_again()
        disk.submit(f"step-{step}", document)
