"""Every command the README shows does what the README says."""
import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

from tests.http.daemon import BIN, Daemon
from tests.support import images
from tests.support.sources import SOURCE, text

README = text("README.md")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```\n", README, re.MULTILINE | re.DOTALL)
# Those of containers are run by tests/container/readme_test.py.
SHELL_BLOCKS = [block for language, block in BLOCKS if language == "sh" and "docker " not in block]
PLAIN_BLOCKS = [block for language, block in BLOCKS if language == ""]


class Readme(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """A folder that looks like the checkout after server/run, and a daemon on another port, patient with slow machines."""
        cls.daemon = cls.enterClassContext(Daemon("--assets", SOURCE / "scenes", "--render-wait-s", "600"))
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        (cls.folder / "scenes").symlink_to(SOURCE / "scenes")
        (cls.folder / "api").symlink_to(SOURCE / "api")
        (cls.folder / "build" / "release").mkdir(parents=True)
        (cls.folder / "build" / "release" / "bin").symlink_to(BIN)

    def run_block(self, containing):
        (block,) = [block for block in SHELL_BLOCKS if containing in block]
        block = block.replace("127.0.0.1:8080", f"127.0.0.1:{self.daemon.port}")
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", block], cwd=self.folder, check=False, timeout=600,
                              capture_output=True, text=True,
                              env={**os.environ, "no_proxy": "*", "WHITTLE_SERVER": f"http://127.0.0.1:{self.daemon.port}"})
        self.assertEqual(done.returncode, 0, f"{block}\n{done.stdout}\n{done.stderr}")
        return done.stdout

    def size_of(self, name):
        height, width, _ = images.read_png((self.folder / name).read_bytes()).shape
        return width, height

    def test_submits_the_sphereflake_and_fetches_its_picture(self):
        job = json.loads(self.run_block("/image.png"))
        self.assertEqual(job["name"], "sphereflake")
        self.assertEqual(self.size_of("sphereflake.png"), (512, 512))

    def test_gets_a_picture_in_one_line(self):
        self.run_block("whitted.json -H")
        self.assertEqual(self.size_of("whitted.png"), (640, 480))

    def test_renders_a_scene_with_files(self):
        self.run_block("-o mesh_files.png")
        self.assertEqual(self.size_of("mesh_files.png"), (800, 450))

    def test_uploads_a_file_and_misses_it_no_more(self):
        uploaded, missing = map(json.loads, self.run_block("/v1/assets/missing").splitlines())
        self.assertEqual(uploaded["bytes"], (SOURCE / "scenes/assets/tile.png").stat().st_size)
        self.assertEqual(missing, {"missing": []})

    def test_submits_a_sweep_of_scenes_with_files(self):
        self.run_block("whittle-submit")
        names = [f"{scene}-fov={fov}.png" for scene in ("mesh_files", "tiny") for fov in (30, 40, 50)]
        self.assertEqual(sorted(path.name for path in (self.folder / "shots").glob("*.png")), names)
        self.assertEqual({self.size_of(f"shots/{name}") for name in names}, {(160, 90)})

    def test_validates(self):
        self.assertTrue(json.loads(self.run_block("/v1/jobs/validate"))["valid"])

    def test_listens_to_a_job_until_it_ends(self):
        heard = self.run_block("curl -sN")
        self.assertEqual(re.findall(r"^event: (state|done)$", heard, re.MULTILINE)[-1], "done")
        self.assertIn('"state":"succeeded"', heard)

    def test_makes_a_key_that_opens_other_addresses(self):
        said = self.run_block("--new-key")
        self.assertRegex(said, r"\Awhittle_[0-9a-f]{64}\n")
        self.assertIn("\nlisten = 0.0.0.0:8080\n", said)

    def test_renders_and_checks_on_the_command_line(self):
        self.assertRegex(self.run_block("whittle check"), r"^valid; needs:\n(  \w+ +#\S+\n)+$")
        self.assertEqual(self.size_of("cornell.png"), (512, 512))
        self.assertEqual(images.read_exr((self.folder / "cornell.exr").read_bytes()).shape, (512, 512, 3))

    def test_compares_two_pictures(self):
        figures = self.run_block("whittle diff")
        (rmse,) = re.findall(r"^rmse +([\d.]+) levels", figures, re.MULTILINE)
        self.assertIn(f"(here {float(rmse):.1f})", README)
        self.assertIn("verdict    rmse within the tolerance of 2 levels\n", figures)
        self.assertEqual(self.size_of("heat.png"), (640, 480))

    def test_measures_what_accuracy_costs(self):
        self.assertIn("- for 4 levels: ", self.run_block("whittle measure"))
        self.assertEqual(self.size_of("tiny.png"), (1200, 760))
        for kind in ("csv", "json", "svg", "reference"):
            self.assertTrue((self.folder / f"tiny.{kind}").stat().st_size > 0, kind)

    def test_submits_a_batch(self):
        batch = json.loads(self.run_block("/v1/batches"))
        self.assertEqual((batch["size"], batch["links"]["self"]), (3, f"/v1/batches/{batch['id']}"))

    def test_measures_over_http(self):
        self.run_block("/v1/measure")
        self.assertEqual(self.size_of("measure.png"), (1200, 760))

    def test_has_every_shell_block_run_here(self):
        self.assertEqual(len(SHELL_BLOCKS), 13)

    def test_names_two_commands_to_start_that_exist(self):
        (block,) = PLAIN_BLOCKS
        self.assertEqual(block.split(), ["server/run", "tests/run"])
        for command in block.split():
            self.assertTrue(os.access(SOURCE / command, os.X_OK), command)

    def test_links_to_files_that_exist(self):
        for page in ("README.md", "scenes/README.md"):
            for link in re.findall(r"\]\(([^):#]+)\)", text(page)):
                self.assertTrue((SOURCE / page).parent.joinpath(link).exists(), f"{page}: {link}")


if __name__ == "__main__":
    unittest.main()
