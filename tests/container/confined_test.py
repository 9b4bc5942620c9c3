"""The image, held as tightly as an engine can: it renders, keeps its jobs, drains, and nothing in it may do more."""
import json
import os
import pathlib
import re
import subprocess
import unittest

from tests.container import images
from tests.container.container import Container
from tests.container.engine import attempt, podman
from tests.http.daemon import Daemon, scene, status_of, wait_until
from tests.support.sources import SOURCE

USER = "10001"
NO_CAPABILITY = "0" * 16
# Its loopback is all that it sees, and all that it needs.
ALONE = ("--network", "none", "--tmpfs", "/tmp", "--memory", "2g", "--pids-limit", "256")


def image_of(daemon, document):
    return daemon.get(daemon.rendered(document)["links"]["image"]).body


class ConfinedContainer(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.image = images.whittle()
        cls.container = cls.enterClassContext(Container(cls.image, *ALONE))

    def test_renders_the_sphereflake_as_the_daemon_outside_does(self):
        document = json.loads((SOURCE / "scenes/sphereflake.json").read_text(encoding="utf-8"))
        with Daemon() as outside:
            expected = image_of(outside, document)
        self.assertEqual(image_of(self.container, document), expected)

    def test_writes_every_format(self):
        formats = ["png", "png16", "exr", "jpg", "hdr", "webp", "tiff"]
        self.assertEqual(len(self.container.rendered(scene(output={"formats": formats}))["artifacts"]), len(formats))

    def test_is_held_by_the_kernel(self):
        self.container.sandbox()
        for pid in (self.container.pid, *self.container.worker_pids()):
            status = status_of(pid)
            self.assertEqual(status["Uid"].split(), [USER] * 4)
            self.assertEqual(status["Gid"].split(), [USER] * 4)
            for kind in ("Inh", "Prm", "Eff", "Bnd", "Amb"):
                self.assertEqual(status[f"Cap{kind}"], NO_CAPABILITY, kind)
            self.assertEqual((status["NoNewPrivs"], status["Seccomp"]), ("1", "2"))

    def test_holds_its_worker_further(self):
        self.assertIn(self.container.sandbox(), ("seccomp", "seccomp, landlock"))
        workers = wait_until(self.container.worker_pids, "the worker")
        # The engine's filter is the daemon's too; the worker's own comes on top, of the spare one as well once it is ready.
        filters = int(status_of(self.container.pid)["Seccomp_filters"])
        for worker in workers:
            wait_until(lambda pid=worker: int(status_of(pid)["Seccomp_filters"]) == filters + 1, "its filter")

    def test_writes_to_its_data_and_nowhere_else(self):
        self.assertTrue(self.container.can_write("/var/lib/whittle"))
        self.assertTrue(self.container.can_write("/tmp"))
        for directory in ("/", "/opt/whittle/bin", "/etc", "/var/lib", "/usr/lib"):
            self.assertFalse(self.container.can_write(directory), directory)
        mounts = pathlib.Path(f"/proc/{self.container.pid}/mountinfo").read_text(encoding="utf-8").splitlines()
        (root,) = [mount.split() for mount in mounts if mount.split()[4] == "/"]
        self.assertIn("ro", root[5].split(","))

    def test_lists_the_packages_of_its_libraries(self):
        root = pathlib.Path(f"/proc/{self.container.pid}/root")
        document = json.loads((root / "usr/share/doc/whittle/sbom.spdx.json").read_text(encoding="utf-8"))
        listed = {package["name"] for package in document["packages"]}
        self.assertEqual(document["spdxVersion"], "SPDX-2.3")
        self.assertLessEqual({"libc6", "libembree3-3", "libopenimageio2.4", "libsqlite3-0"}, listed)
        licensed = {path.parent.name for path in root.glob("usr/share/doc/*/copyright")}
        self.assertLessEqual(licensed, listed)

    def test_holds_no_program_but_its_own(self):
        root = pathlib.Path(f"/proc/{self.container.pid}/root")
        found = {str(path.relative_to(root)) for top in ("bin", "sbin", "usr", "opt", "etc", "var") for path in (root / top).rglob("*")
                 if path.is_file() and not path.is_symlink() and os.access(path, os.X_OK) and ".so" not in path.name}
        self.assertEqual(found, {f"opt/whittle/bin/{program}" for program in images.PROGRAMS})

    def test_is_found_healthy_by_its_own_check(self):
        self.assertEqual(attempt("healthcheck", "run", self.container.name).returncode, 0)

    def test_has_a_title_a_version_and_a_user(self):
        (image,) = json.loads(podman("image", "inspect", self.image))
        labels = image["Labels"]
        self.assertEqual((labels["org.opencontainers.image.title"], labels["org.opencontainers.image.version"]), ("Whittle", "0.1.0"))
        self.assertEqual((image["User"], image["Config"]["StopSignal"]), (f"{USER}:{USER}", "SIGTERM"))

    @unittest.skipIf(images.COMPILE, "programs that are compiled in the image have no names of functions left")
    def test_is_one_image_for_every_x86_64_machine(self):
        """Registers wider than 128 bits are used by those functions alone that the loader picks for the processor it finds."""
        for program in images.PROGRAMS:
            wide = functions_with_wide_registers(f"/proc/{self.container.pid}/root/opt/whittle/bin/{program}")
            self.assertEqual([name for name in wide if not re.search(r"\.arch_x86_64_v[34]$", name)], [], program)


def functions_with_wide_registers(program):
    code = subprocess.run(["objdump", "--disassemble", "--no-show-raw-insn", program], check=True, capture_output=True, text=True)
    found, function = set(), ""
    for line in code.stdout.splitlines():
        if line.endswith(">:"):
            function = line.partition("<")[2][:-2]
        elif "%ymm" in line or "%zmm" in line:
            found.add(function)
    return sorted(found)


class ConfinedLife(unittest.TestCase):
    def setUp(self):
        self.container = self.enterContext(Container(images.whittle(), *ALONE))

    def test_drains_on_sigterm(self):
        """A job that runs is finished, a waiting request answered, then it ends with 0."""
        job_id = self.container.submit(scene(400, 300, samples=64))
        self.container.wait_for_state(job_id, "running", "succeeded")
        podman("stop", "--time", "60", self.container.name)
        self.assertEqual(self.container.exit_code(), 0)
        last = json.loads(self.container.log().splitlines()[-1])
        self.assertEqual((last["event"], last["all_jobs_finished"]), ("stopped", True))
        self.container.start()
        self.assertEqual(self.container.job(job_id)["state"], "succeeded")

    def test_does_not_start_on_what_it_may_not_write(self):
        with self.assertRaises(AssertionError):
            with Container(images.whittle(), *ALONE, "--volume", "/etc:/var/lib/whittle:ro"):
                pass


class MemoryLimit(unittest.TestCase):
    def test_ends_a_render_and_not_the_daemon(self):
        limits = ("--network", "none", "--memory", "400m", "--memory-swap", "400m", "--pids-limit", "128")
        with Container(images.whittle(), *limits) as container:
            daemon = container.pid
            waiting = container.submit(scene(8000, 8000, samples=1, name="too large for this container"))
            job = container.wait_for_end(waiting)
            self.assertEqual((job["state"], job["problem"]["code"]), ("failed", "worker_crashed"), job)
            self.assertEqual(container.pid, daemon)
            image_of(container, scene())
