"""Every command in the documents runs and has the documented effect."""
import json
import os
import re
import subprocess
import unittest

from tests.docs.documents import PAGES, blocks
from tests.http.daemon import BIN, Daemon
from tests.support import images
from tests.support.postgres import ACCOUNT, PostgresServer
from tests.support.sources import SOURCE, text
from tests.support.whittle import temporary_directory


def setUpModule():
    """One daemon on free ports for all pages, patient with slow machines, and one server of PostgreSQL."""
    global DAEMON, POSTGRES  # pylint: disable=global-variable-undefined
    POSTGRES = PostgresServer()
    unittest.addModuleCleanup(POSTGRES.close)
    DAEMON = unittest.enterModuleContext(Daemon("--assets", SOURCE / "scenes", "--render-wait-s", "600"))


class Page(unittest.TestCase):
    """Runs the `sh` blocks of a page in order, in a directory that looks like a checkout after server/run."""

    page = None

    @classmethod
    def setUpClass(cls):
        cls.directory = temporary_directory(cls)
        for name in ("api", "docker", "scenes", "server", "tests"):
            (cls.directory / name).symlink_to(SOURCE / name)
        (cls.directory / "build" / "release").mkdir(parents=True)
        (cls.directory / "build" / "release" / "bin").symlink_to(BIN)
        (cls.directory / "data").symlink_to(DAEMON.data)
        cls.done = [(block.code, cls.run_commands(block.code)) for block in blocks(cls.page, "sh")]

    @classmethod
    def run_commands(cls, code):
        code = code.replace("127.0.0.1:8080", f"127.0.0.1:{DAEMON.port}")
        code = code.replace("127.0.0.1:8081", f"127.0.0.1:{DAEMON.health_port}")
        variables = {"no_proxy": "*", "PGHOST": POSTGRES.directory, "PGUSER": ACCOUNT, "WHITTLE_BIN": str(BIN), "WHITTLE_SERVER": f"http://127.0.0.1:{DAEMON.port}"}
        return subprocess.run(["bash", "-euo", "pipefail", "-c", code], cwd=cls.directory, check=False, timeout=900,
                              capture_output=True, text=True, env={**os.environ, **variables})

    def output(self, containing):
        """Standard output of the one block that contains a string."""
        (done,) = [done for code, done in self.done if containing in code]
        return done.stdout

    def size_of(self, name):
        height, width, _ = images.read_png((self.directory / name).read_bytes()).shape
        return width, height

    def test_commands_succeed(self):
        for code, done in self.done:
            with self.subTest(code=code):
                self.assertEqual(done.returncode, 0, f"{code}\n{done.stdout}\n{done.stderr}")


class Readme(Page):
    page = "README.md"

    def test_renders_in_one_request(self):
        self.assertEqual(self.size_of("whitted.png"), (640, 480))

    def test_submits_a_job_and_downloads_its_image(self):
        job = json.loads(self.output("sphereflake"))
        self.assertEqual((job["name"], job["state"]), ("sphereflake", "succeeded"))
        self.assertEqual(self.size_of("sphereflake.png"), (512, 512))

    def test_renders_and_checks_on_the_command_line(self):
        (shown,) = (block.code.splitlines() for block in blocks(self.page, "console") if block.code.startswith("$ "))
        done = self.run_commands(shown[0].removeprefix("$ ")).stderr.splitlines()
        self.assertEqual([line.split()[0] for line in done], [line.split()[0] for line in shown[1:]])
        self.assertEqual([done[-1], shown[-1]], ["target 1: met"] * 2)
        self.assertRegex(self.output("whittle check"), r"\A.*valid.*\n(  \w+ +#\S+\n)+global light .+\n\Z")
        self.assertEqual(self.size_of("cornell.png"), (512, 512))
        self.assertEqual(images.read_exr((self.directory / "cornell.exr").read_bytes()).shape, (512, 512, 3))

    def test_measures(self):
        self.assertRegex(self.output("whittle measure"), r"(?m)^- for 4 \w")
        self.assertEqual(self.size_of("tiny.png"), (1200, 760))
        for kind in ("csv", "json", "svg", "reference"):
            self.assertTrue((self.directory / f"tiny.{kind}").stat().st_size > 0, kind)

    def test_compares_two_images(self):
        figures = self.output("whittle diff")
        (rmse,) = re.findall(r"^rmse +([\d.]+) ", figures, re.MULTILINE)
        self.assertIn(f"(here with an RMS of {float(rmse):.1f})", text(self.page))
        self.assertRegex(figures, r"(?m)^result +rmse within the tolerance of 2 ")
        self.assertEqual(self.size_of("heat.png"), (640, 480))

    def test_submits_a_sweep_of_scenes_with_files(self):
        names = [f"{scene}-fov={fov}.png" for scene in ("mesh_files", "tiny") for fov in (30, 40, 50)]
        self.assertEqual(sorted(path.name for path in (self.directory / "shots").glob("*.png")), names)
        self.assertEqual({self.size_of(f"shots/{name}") for name in names}, {(160, 90)})


class Tests(Page):
    page = "tests/README.md"

    def test_runs_single_tests(self):
        self.assertRegex(self.output("gtest_filter"), r"\[  PASSED  \] [1-9]")

    def test_replays_a_corpus(self):
        self.assertRegex(self.output("fuzz_reader"), r"(?m)^replayed [1-9]\d* inputs?")


# Pages without expectations of their own: their commands run.
for other in set(PAGES) - {page.page for page in Page.__subclasses__()}:
    if blocks(other, "sh"):
        name = re.sub(r"\W", "_", other)
        globals()[name] = type(name, (Page,), {"page": other})
del Page  # not a page itself
