"""The sandbox of the worker: it renders every example scene in every format, also without any capability."""
import json
import os
import pathlib
import shutil
import unittest

from tests.http.daemon import SANITIZED, Daemon, scene, status_of
from tests.support.sources import SOURCE

FORMATS = ["png", "png16", "exr", "jpg", "hdr", "webp", "tiff"]
NO_CAPABILITIES = ("setpriv", "--bounding-set=-all", "--inh-caps=-all", "--ambient-caps=-all", "--no-new-privs")


def small(path):
    """The scene at `path` with few pixels and one sample for each."""
    document = json.loads(path.read_text(encoding="utf-8"))
    document["image"] = {"width": 32, "height": 24}
    document["accuracy"] = {"samples": [1, 1]}
    document["output"] = {"formats": FORMATS}
    return document


class Sandbox(unittest.TestCase):
    def test_confines_the_worker_and_is_reported(self):
        with Daemon() as daemon:
            reported = daemon.sandbox()
            if SANITIZED:
                self.assertEqual(reported, "none")
                return
            self.assertIn(reported, ("seccomp", "seccomp, landlock"))
            self.assertEqual("sandbox_incomplete" in daemon.log(), reported != "seccomp, landlock")
            status = status_of(daemon.worker())
            self.assertEqual((status["Seccomp"], status["NoNewPrivs"]), ("2", "1"))
            held = {name: int(status[name], 16) for name in ("CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb")}
            self.assertFalse(any(held.values()) and os.geteuid() == 0, held)

    @unittest.skipIf(SANITIZED, "a sanitizer maps terabytes")
    def test_limits_the_resources_of_the_worker(self):
        with Daemon("--jobs", "3", "--job-memory-bytes", str(1 << 30)) as daemon:
            daemon.sandbox()
            lines = pathlib.Path(f"/proc/{daemon.worker()}/limits").read_text(encoding="ascii").splitlines()
            limits = {line[:26].strip(): line[26:].split()[:2] for line in lines}
            for name, most in (("Max open files", 256 + 3 * 32), ("Max data size", (2 << 30) + 2 * 3 * (1 << 30)),
                               ("Max file size", 1 << 30), ("Max core file size", 0), ("Max msgqueue size", 0)):
                self.assertEqual(limits[name], [str(most)] * 2, name)

    def test_gives_the_daemon_priority(self):
        with Daemon() as daemon:
            daemon.sandbox()
            daemons, workers = (os.getpriority(os.PRIO_PROCESS, which) for which in (daemon.process.pid, daemon.worker()))
            self.assertEqual(workers, min(19, daemons + 5))

    def test_every_example_renders_in_every_format(self):
        paths = sorted((SOURCE / "scenes").glob("*.json"))
        self.assertGreater(len(paths), 10)
        with Daemon("--assets", SOURCE / "scenes") as daemon:
            ids = {path.name: daemon.submit(small(path)) for path in paths}
            for name, job_id in ids.items():
                job = daemon.wait_for_end(job_id)
                self.assertEqual((job["state"], len(job["artifacts"])), ("succeeded", len(FORMATS)), f"{name}: {job['problem']}")
            self.assertIn(daemon.worker(), daemon.worker_pids())
            self.assertFalse(daemon.log_rows("worker_ended"))

    @unittest.skipUnless(shutil.which("setpriv"), "no setpriv")
    def test_needs_no_capability(self):
        with Daemon("--assets", SOURCE / "scenes", wrapper=NO_CAPABILITIES) as daemon:
            daemon.sandbox()
            self.assertEqual(int(status_of(daemon.worker())["CapBnd"], 16), 0)
            daemon.rendered(small(SOURCE / "scenes" / "mesh_files.json"))

    def test_needs_no_asset_directory(self):
        with Daemon() as daemon:
            daemon.rendered(scene(output={"formats": FORMATS}))
