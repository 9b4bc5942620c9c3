"""The nodes of docker/compose.yaml: the preparations in its first lines and then the commands of server/README.md, as they stand, with podman
and docker-compose in place of docker."""
import collections
import re
import subprocess
import unittest

from tests.container import images, machine
from tests.container.compose_test import PROJECT, Compose, Proxied
from tests.container.container import Running
from tests.container.engine import podman_environment
from tests.docs.documents import blocks
from tests.http.daemon import json_of
from tests.support.images import read_png
from tests.support.sources import SOURCE, text
from tests.support.whittle import temporary_directory

(COMMANDS,) = [block.code for block in blocks("server/README.md", "console") if "--profile cluster" in block.code]
PREPARATIONS = [line[4:] for line in re.findall(r"^#   .*", text("docker/compose.yaml"), re.MULTILINE) if "docker compose" not in line]


class ClusterOfTheReadme(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        images.proxy()
        images.database()
        if reason := machine.why_no_networks() or machine.why_no("docker-compose", "openssl"):
            raise unittest.SkipTest(f"Compose joins services by a network: {reason}")
        cls.directory = temporary_directory(cls)
        compose = Compose(cls.directory)
        cls.addClassCleanup(compose.down)
        for name in ("api", "scenes"):
            (cls.directory / name).symlink_to(SOURCE / name)
        output = compose.run("\n".join(PREPARATIONS))
        compose.key = re.search(r"^whittle_[0-9a-f]{64}$", output, re.MULTILINE).group()
        variables = {"WHITTLE_KEY": compose.key, "SSL_CERT_FILE": str(compose.directory / "secrets/tls.crt"), "no_proxy": "*"}
        try:
            cls.output = compose.run(COMMANDS, variables, checked=["database"])
        except AssertionError as failure:
            logs = [Running(f"{PROJECT}_{service}_1").log() for service in ("api", "worker", "balancer", "database")]
            raise AssertionError("\n".join(logs)) from failure
        cls.daemon = Proxied(compose, "balancer").until_open()

    def test_renders_the_batch_on_both_workers(self):
        nodes = json_of(self.daemon.get("/v1/nodes"))["items"]
        self.assertEqual(sorted(node["role"] for node in nodes), ["api", "api", "worker", "worker"])
        jobs = self.daemon.jobs()
        self.assertEqual((len(jobs), {job["state"] for job in jobs}), (200, {"succeeded"}))
        taken = collections.Counter()
        for job in jobs:
            history = json_of(self.daemon.get(f"/v1/jobs/{job['id']}/history"))["items"]
            taken[next(move["worker"] for move in history if move["state"] == "running")] += 1
        print(f"200 images; rendered by each worker: {sorted(taken.values())}")
        self.assertEqual(set(taken), {node["id"] for node in nodes if node["role"] == "worker"})

    def test_downloads_all_images(self):
        shots = sorted((self.directory / "shots").glob("*.png"))
        self.assertEqual(len(shots), 200, self.output)
        self.assertEqual({read_png(path.read_bytes()).shape[1] for path in shots}, {32, 64, 96, 128})

    def test_starts_two_nodes_of_each_role_without_the_single_daemon(self):
        services = subprocess.run(["podman", "ps", "--format", "{{.Names}}"], check=True, capture_output=True, text=True,
                                  env=podman_environment()).stdout.split()
        self.assertEqual(sorted(re.sub(r"^[a-z]+_|_\d+$", "", name) for name in services),
                         ["api", "api", "balancer", "database", "worker", "worker"])
