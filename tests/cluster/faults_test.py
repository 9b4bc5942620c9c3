"""Faults of nodes, of the database and of the network, under load: no acknowledged job is lost, no result is written twice, no image
is wrong."""
import contextlib
import ipaddress
import itertools
import json
import os
import random
import subprocess
import time
import unittest

from tests.cluster.load import Load, expected_images
from tests.cluster.nodes import Cluster
from tests.http.daemon import json_of, scene, wait_until
from tests.support import leftovers
from tests.support.whittle import BIN

LEASE = ("--lease-s", "2")
NODE_KILLS, DATABASE_KILLS, OUTAGE_S = (100, 20, 30) if os.environ.get("WHITTLE_LONG") else (4, 1, 4)


class FaultsTest(unittest.TestCase):
    @contextlib.contextmanager
    def load(self, faults):
        """Two nodes for clients, which get jobs until the end of the block, and two for renders; then checks the jobs."""
        with Cluster() as cluster:
            apis, workers = ([cluster.node(role, *LEASE) for _ in range(2)] for role in ("api", "worker"))
            load = Load(apis)
            try:
                yield cluster, load, [workers[0], apis[0], workers[1], apis[1]]
            finally:
                load.stop()
            print(faults, end=": ")
            load.check(self, cluster, expected_images())

    def test_kill_9_of_nodes(self):
        choices = random.Random(1)
        with self.load(f"{NODE_KILLS} kill -9 of nodes") as (_, _, nodes):
            for victim in itertools.islice(itertools.cycle(nodes), NODE_KILLS):
                time.sleep(choices.uniform(0.3, 1.5))
                victim.kill()
                time.sleep(choices.uniform(0, 0.5))
                victim.start()

    def test_kill_9_of_the_database(self):
        choices = random.Random(2)
        with self.load(f"{DATABASE_KILLS} kill -9 of PostgreSQL") as (cluster, load, _):
            for _ in range(DATABASE_KILLS):
                time.sleep(choices.uniform(0.5, 2))
                cluster.server.kill()
                cluster.server.start()
            before = len(load.acknowledged)
            wait_until(lambda: len(load.acknowledged) > before, "a job after the last restart")

    def test_database_down(self):
        with Cluster() as cluster:
            node = cluster.node("all", *LEASE)
            cluster.node("worker", *LEASE, "--threads", "1", "--jobs", "1")
            first = node.submit(scene(64, 48))
            wait_until(lambda: cluster.sql(f"SELECT state FROM jobs WHERE id = '{first}'") == "succeeded", "the first job")
            long = node.start_job(scene(1200, 900, samples=8, name="long"))
            cluster.server.stop()
            end = time.monotonic() + OUTAGE_S
            while time.monotonic() < end:
                refused = node.request("POST", "/v1/jobs", scene())
                self.assertEqual(refused.status, 503, refused.body)
                self.assertTrue(int(refused.headers["Retry-After"]) > 0)
                time.sleep(0.2)
            cluster.server.start()
            wait_until(lambda: node.get(f"/v1/jobs/{long}").status == 200, "the database")
            ended = node.wait_for_end(long)
            moves = [move["state"] for move in json_of(node.get(f"/v1/jobs/{long}/history"))["items"]]
            print(f"database down for {OUTAGE_S} s: the render ended as {ended['state']}, attempt {ended['attempt']}, moves {moves}")
            self.assertEqual((ended["state"], ended["attempt"], moves), ("succeeded", 1, ["queued", "running", "succeeded"]))

    def test_clocks_that_differ_by_ten_minutes(self):
        with Cluster() as cluster:
            def shifted(seconds):
                return {"LD_PRELOAD": str(BIN / "shifted_clock.so"), "SHIFTED_CLOCK_S": str(seconds)}
            ahead, behind = (cluster.node("all", *LEASE, environment=shifted(seconds)) for seconds in (600, -600))
            self.assertNotEqual(ahead.log_rows()[0]["time"][:15], behind.log_rows()[0]["time"][:15], "the clocks differ")
            long = behind.submit(scene(700, 600, samples=8, name="longer than a lease"))
            jobs = [node.submit(scene(job={"run_after": self.moment(cluster, 1)})) for _ in range(3) for node in (ahead, behind)]
            listed = [job["id"] for job in json_of(ahead.get("/v1/jobs"))["items"]]
            self.assertEqual(listed, [*reversed(jobs), long], "the order of submission")
            for job in [long, *jobs]:
                ended = behind.wait_for_end(job)
                self.assertEqual((ended["state"], ended["attempt"]), ("succeeded", 1))
                self.assertEqual([move["state"] for move in json_of(ahead.get(f"/v1/jobs/{job}/history"))["items"]],
                                 ["queued", "running", "succeeded"], "no lease was taken back")
            early = cluster.sql("SELECT count(*) FROM jobs WHERE started_at < run_after")
            wrong = cluster.sql("SELECT count(*) FROM jobs WHERE abs(created_at - extract(epoch FROM now()) * 1000) > 300000")
            print(f"clocks 20 minutes apart: {len(jobs) + 1} jobs, started early {early}, wrong times {wrong}")
            self.assertEqual((early, wrong), ("0", "0"))

    @staticmethod
    def moment(cluster, seconds):
        return cluster.sql(f"SELECT to_char((now() + interval '{seconds} s') AT TIME ZONE 'UTC', 'YYYY-MM-DD\"T\"HH24:MI:SS.MS\"Z\"')")

    def test_a_newer_schema_beside(self):
        """The next version adds columns with defaults and tables: nodes of this version go on, and start."""
        with Cluster() as cluster:
            older = cluster.node("all", *LEASE)
            older.wait_for_end(older.submit(scene()))
            cluster.sql("ALTER TABLE jobs ADD COLUMN later BIGINT NOT NULL DEFAULT 0")
            cluster.sql("CREATE TABLE later (id BIGINT)")
            cluster.sql("UPDATE whittle_schema SET version = version + 1")
            restarted = cluster.node("all", *LEASE)
            for node in (older, restarted):
                node.rendered(scene())


def run(*words):
    subprocess.run(words, check=True, capture_output=True)


def free_network():
    """A network of two addresses that no interface has. The range is reserved for tests between networks (RFC 2544)."""
    printed = subprocess.run(["ip", "-json", "address"], check=True, capture_output=True, text=True).stdout
    used = [ipaddress.ip_network(f"{each['local']}/{each['prefixlen']}", strict=False)
            for interface in json.loads(printed) for each in interface.get("addr_info", []) if each["family"] == "inet"]
    candidates = list(ipaddress.ip_network("198.18.0.0/15").subnets(new_prefix=30))
    return next(each for each in random.sample(candidates, len(candidates)) if not any(each.overlaps(other) for other in used))


class Network:
    """A network namespace that is connected with this one. Use as a context manager."""

    def __init__(self):
        self.name = leftovers.name_of(os.getpid())
        self.outer, self.inner = f"wo{os.getpid()}"[:15], f"wi{os.getpid()}"[:15]
        self.address, self.inner_address = map(str, free_network().hosts())

    def __enter__(self):
        run("ip", "netns", "add", self.name)
        run("ip", "link", "add", self.outer, "type", "veth", "peer", "name", self.inner, "netns", self.name)
        run("ip", "address", "add", f"{self.address}/30", "dev", self.outer)
        run("ip", "link", "set", self.outer, "up")
        run("ip", "-n", self.name, "address", "add", f"{self.inner_address}/30", "dev", self.inner)
        run("ip", "-n", self.name, "link", "set", self.inner, "up")
        run("ip", "-n", self.name, "link", "set", "lo", "up")
        return self

    def __exit__(self, *_):
        run("ip", "link", "delete", self.outer)  # with the namespace it would be deleted some time later
        run("ip", "netns", "delete", self.name)

    @property
    def wrapper(self):
        return ("nsenter", f"--net=/run/netns/{self.name}")

    def drop_silently(self):
        """Packets in both directions go to an address of nobody."""
        run("ip", "neighbour", "replace", self.inner_address, "lladdr", "02:00:00:00:00:99", "dev", self.outer, "nud", "permanent")
        run("ip", "-n", self.name, "neighbour", "replace", self.address, "lladdr", "02:00:00:00:00:98", "dev", self.inner, "nud",
            "permanent")

    def lose_carrier(self):
        run("ip", "link", "set", self.outer, "down")

    def restore(self):
        run("ip", "link", "set", self.outer, "up")
        for words in (("ip", "neighbour", "delete", self.inner_address, "dev", self.outer),
                      ("ip", "-n", self.name, "neighbour", "delete", self.address, "dev", self.inner)):
            subprocess.run(words, check=False, capture_output=True)  # none after a loss of the carrier


@unittest.skipUnless(os.geteuid() == 0, "network namespaces need root")
class CutOffTest(unittest.TestCase):
    """A node without a network for three times its lease."""

    def cut_off(self, cut):
        with Network() as network, Cluster(("fsync=on", f"listen_addresses={network.address}")) as cluster:
            cluster.allow(f"{network.inner_address}/32")
            api = cluster.node("api", *LEASE)
            socket_uri = cluster.uri
            cluster.uri = f"postgres://postgres@{network.address}/{cluster.database}"
            lost = cluster.node("worker", *LEASE, wrapper=network.wrapper)
            cluster.uri = socket_uri
            job = api.start_job(scene(1600, 1200, samples=6))
            cut(network)
            start = time.monotonic()
            cluster.node("worker", *LEASE)
            claims = f"SELECT count(*) FROM moves WHERE job_id = '{job}' AND state = 'running'"
            wait_until(lambda: cluster.sql(claims) == "2", "the second claim")
            taken_s = time.monotonic() - start
            time.sleep(max(0, 6 - taken_s))
            network.restore()
            restored_at = FaultsTest.moment(cluster, 0)
            ended = api.wait_for_end(job)
            wait_until(lambda: any(row["event"] == "lease_lost" for row in lost.log_rows()) or
                       any(row["event"] == "store_failure" and row["during"] == "succeed" for row in lost.log_rows()), "the loss")
            def returned():
                node = min((node for node in json_of(api.get("/v1/nodes"))["items"] if node["role"] == "worker"),
                           key=lambda node: node["started_at"])
                return node["running"] == 0 and node["seen_at"] > restored_at
            wait_until(returned, "the return of the node")
            written = cluster.sql(f"SELECT count(*) FROM moves WHERE job_id = '{job}' AND state = 'succeeded'")
            late = [row for row in lost.log_rows() if row["event"] == "job_succeeded"]
            print(f"{cut.__name__}: taken over after {taken_s:.1f} s; written {written} times, by the late node {len(late)}")
            self.assertEqual((ended["state"], ended["attempt"], written, late), ("succeeded", 1, "1", []))
            api.rendered(scene())

    def test_by_silent_loss_of_packets(self):
        self.cut_off(Network.drop_silently)

    def test_by_loss_of_the_carrier(self):
        self.cut_off(Network.lose_carrier)
