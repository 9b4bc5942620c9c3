"""docker/compose.yaml as it stands, started by docker-compose through the engine's interface, spoken to through its TLS
proxy."""
import http.client
import shutil
import ssl
import subprocess
import time
import unittest

from tests.container import images, machine
from tests.container.container import Running
from tests.container.engine import STORE, attempt, podman_environment
from tests.http.daemon import PATIENCE_S, Served, json_of, long_scene, put, sha256, wait_until
from tests.http.keys_test import new_key
from tests.support.sources import SOURCE
from tests.support.whittle import temporary_directory

PROJECT = "whittletest"
ASSET_BYTES = 100_000_000


def write_secrets(directory):
    """A key and a certificate for localhost; the key."""
    directory.mkdir()
    key = new_key(directory / "keys", "test")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2",
                    "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost", "-keyout", directory / "tls.key",
                    "-out", directory / "tls.crt"], check=True, capture_output=True)
    for path in directory.iterdir():
        path.chmod(0o644)  # read by the users of the containers
    return key


class Compose:
    """The services of compose.yaml, until they are taken down."""

    def __init__(self, directory):
        self.directory = directory / "docker"
        shutil.copytree(SOURCE / "docker", self.directory, ignore=shutil.ignore_patterns("secrets"))
        self.key = write_secrets(self.directory / "secrets")
        self.address = STORE / "podman.sock"
        self.address.unlink(missing_ok=True)
        # pylint: disable-next=consider-using-with
        self.service = subprocess.Popen(["podman", "system", "service", "--time", "0", f"unix://{self.address}"],
                                        env=podman_environment(), cwd=STORE, stderr=subprocess.DEVNULL)
        wait_until(self.address.exists, "podman's service")

    def run(self, lines, variables=None, checked=()):
        """Runs commands in which `docker` is podman and docker-compose. Without systemd nobody checks the health of the `checked`
        services but this."""
        compose = f"docker-compose --host unix://{self.address} --project-name {PROJECT}"
        docker = f'docker() {{ if [ "$1" = compose ]; then shift; {compose} "$@"; else podman "$@"; fi; }}'
        environment = {**podman_environment(), "COMPOSE_INTERACTIVE_NO_CLI": "1", **(variables or {})}
        with open(self.directory / "log", "w+", encoding="utf-8") as log:
            with subprocess.Popen(["bash", "-euc", f"{docker}\n{lines}"], cwd=self.directory.parent, stdout=log, stderr=log,
                                  env=environment) as running:
                end = time.monotonic() + PATIENCE_S
                while running.poll() is None and time.monotonic() < end:
                    for service in checked:
                        attempt("healthcheck", "run", f"{PROJECT}_{service}_1")
                    time.sleep(0.2)
                running.kill()
            log.seek(0)
            output = log.read()
        if running.returncode != 0:
            raise AssertionError(f"{lines}\n{output}")
        return output

    def up(self):
        """The proxy waits for a healthy daemon."""
        self.run("docker compose -f docker/compose.yaml --profile tls up --detach --no-build", checked=["whittle"])

    def down(self):
        try:
            self.run("docker compose -f docker/compose.yaml --profile tls --profile cluster down --volumes --timeout 1")
        finally:
            self.service.terminate()
            self.service.wait(PATIENCE_S)


class Proxied(Served):
    """The daemon through the proxy, over TLS; every request brings the key."""

    def __init__(self, compose, proxy="proxy"):
        self.proxy = proxy
        self.port = 8443
        self.trust = ssl.create_default_context(cafile=compose.directory / "secrets" / "tls.crt")
        self.allowed = {"Authorization": f"Bearer {compose.key}"}

    def connection(self, port):
        return http.client.HTTPSConnection("localhost", port, timeout=PATIENCE_S, context=self.trust)

    def until_open(self):
        """The proxy listens some moments after it was started."""
        proxy = Running(f"{PROJECT}_{self.proxy}_1")

        def answers():
            if not proxy.pid:
                raise AssertionError(f"the proxy ended:\n{proxy.log()}")
            try:
                return self.get("/v1/version").status == 200
            except ConnectionError:
                return False
        wait_until(answers, "the proxy to listen")
        return self


class ComposeBehindTls(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        images.proxy()
        if reason := machine.why_no_networks() or machine.why_no("docker-compose", "openssl"):
            raise unittest.SkipTest(f"Compose joins services by a network: {reason}")
        compose = Compose(temporary_directory(cls))
        cls.addClassCleanup(compose.down)
        compose.up()
        cls.compose = compose
        cls.daemon = Proxied(compose).until_open()

    def test_wants_the_key(self):
        self.assertEqual(self.daemon.request("GET", "/v1/jobs", headers={"Authorization": "Bearer none"}).status, 401)

    def test_passes_events_on_as_they_happen(self):
        """The first ones come while the job still runs, and long before its end could flush a buffer."""
        job_id = self.daemon.submit(long_scene())
        stream = self.enterContext(self.daemon.sent("GET", f"/v1/jobs/{job_id}/events")).getresponse()
        self.assertEqual(stream.headers["Content-Type"], "text/event-stream")
        received = b""
        while b"event: progress" not in received:
            line = stream.readline()
            self.assertTrue(line, received)
            received += line
        self.assertEqual(self.daemon.job(job_id)["state"], "running")
        self.daemon.request("POST", f"/v1/jobs/{job_id}/cancel")
        self.assertIn(b'"state":"cancelled"', received + stream.read())

    def test_takes_an_asset_of_100_megabytes(self):
        block = sha256(b"an asset").encode() * 500
        asset = (block * (ASSET_BYTES // len(block) + 1))[:ASSET_BYTES]
        self.assertEqual(json_of(put(self.daemon, asset), 201)["bytes"], ASSET_BYTES)
        self.assertEqual(self.daemon.request("HEAD", f"/v1/assets/{sha256(asset)}").headers["Content-Length"], str(ASSET_BYTES))
