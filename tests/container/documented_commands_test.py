"""The container commands of server/README.md, with podman in place of docker."""
import re
import subprocess
import unittest

from tests.container import images, machine
from tests.container.container import Container, Running
from tests.container.engine import attempt, podman, podman_environment
from tests.docs.documents import blocks
from tests.http.daemon import json_of, scene
from tests.support.whittle import temporary_directory

CONSOLE = [block.code for block in blocks("server/README.md", "console")]
COMMANDS = [code for code in CONSOLE if "docker run" in code]
(PINNED,) = [code for code in CONSOLE if "BASE=" in code]


class ContainerCommands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        images.whittle()
        if reason := machine.why_no_networks():
            raise unittest.SkipTest(f"they open a port: {reason}")
        cls.directory = temporary_directory(cls)
        cls.addClassCleanup(attempt, "volume", "rm", "--force", "whittle")
        cls.addClassCleanup(attempt, "rm", "--force", "--time", "0", "whittle")
        start, maintenance = COMMANDS
        cls.check_config, cls.backup = maintenance.splitlines()
        build, *lines = start.splitlines()
        assert build == "docker build -f docker/Dockerfile -t whittle .", build  # which tests.container.images did
        done = cls.run_lines("\n".join(lines))
        cls.key = {"Authorization": "Bearer " + re.search(r"^whittle_[0-9a-f]{64}$", done.stderr, re.MULTILINE).group()}
        cls.daemon = Running("whittle").until_ready()

    @classmethod
    def run_lines(cls, lines):
        done = subprocess.run(["bash", "-euc", f'docker() {{ podman "$@"; }}\n{lines}'], cwd=cls.directory, env=podman_environment(),
                              check=False, capture_output=True, text=True, timeout=300)
        if done.returncode != 0:
            raise AssertionError(f"{lines}\n{done.stdout}{done.stderr}")
        return done

    def test_start_a_daemon_that_takes_the_key(self):
        self.assertEqual(self.daemon.get("/v1/jobs").status, 401)
        self.assertEqual(self.daemon.request("GET", "/v1/jobs", headers=self.key).status, 200)

    def test_pin_the_base_image_by_its_digest(self):
        pull, inspect, build = PINNED.splitlines()
        self.assertEqual(pull, "docker pull debian:bookworm-slim")  # a registry is not needed here: the image is in the store
        base = self.run_lines(f"{inspect}\necho \"$base\"").stdout.strip()
        self.assertRegex(base, r"^\S*debian@sha256:[0-9a-f]{64}$")
        self.assertEqual(build, 'docker build -f docker/Dockerfile -t whittle --build-arg BASE="$base" .')
        label = "{{index .Labels \"org.opencontainers.image.base.name\"}}"
        self.assertEqual(podman("image", "inspect", "--format", label, "whittle"), base)  # tests.container.images built so

    def test_check_the_settings_of_another_version(self):
        self.assertIn("listen = 0.0.0.0:8080\n", self.run_lines(self.check_config).stdout)
        with self.assertRaisesRegex(AssertionError, "whittled: --pixels: "):
            self.run_lines(f"{self.check_config} --pixels none")

    def test_make_a_backup_that_can_be_restored(self):
        submitted = json_of(self.daemon.request("POST", "/v1/jobs", scene(), {**self.key, "Prefer": "wait=30"}))
        path = f"/v1/jobs/{submitted['id']}/image.png"
        image = self.daemon.request("GET", path, headers=self.key).body
        self.run_lines(self.backup)
        (copy,) = self.directory.glob("????-??-??")
        subprocess.run(["chown", "-R", "10001:10001", copy], check=True)
        with Container("whittle", "--network", "none", "--volume", f"{copy}:/var/lib/whittle") as restored:
            self.assertEqual(restored.get(path).body, image)
