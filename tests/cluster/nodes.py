"""Nodes of one cluster: daemons on one PostgreSQL database, with a directory of images that all share."""
import contextlib
import pathlib
import shutil
import tempfile

from tests.http.daemon import Daemon, json_of, wait_until
from tests.support.postgres import PostgresServer


class Node(Daemon):
    """A daemon with a part of its own; a worker has no port for clients."""

    def __init__(self, cluster, role, *options, environment=None, wrapper=()):
        self.role = role
        self.cluster = cluster
        super().__init__("--role", role, "--database", cluster.uri, *cluster.files, *options, data=cluster.new_data(),
                         environment=environment, wrapper=wrapper)

    def read_port(self, what):
        return None if what == "listening" and self.role == "worker" else super().read_port(what)


class Cluster(contextlib.AbstractContextManager):
    """The database of a test. Use as a context manager, which also ends the nodes."""

    def __init__(self, settings=("fsync=on",)):
        self.server = PostgresServer(settings)
        self.database = self.server.new_database()
        self.uri = self.server.uri(self.database)
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="whittle-cluster-"))
        (self.directory / "files").mkdir()
        self.files = ("--artifacts", self.directory / "files")
        self.nodes = []

    def __exit__(self, *_):
        for node in self.nodes:
            node.__exit__()
        self.server.close()
        shutil.rmtree(self.directory)

    def new_data(self):
        return tempfile.mkdtemp(prefix="data", dir=self.directory)

    def node(self, role="all", *options, **changes):
        self.nodes.append(Node(self, role, *options, **changes))
        return self.nodes[-1]

    def allow(self, network):
        """Lets clients of a network connect."""
        with open(f"{self.server.data}/pg_hba.conf", "a", encoding="utf-8") as rules:
            rules.write(f"host all all {network} trust\n")
        self.sql("SELECT pg_reload_conf()")

    def sql(self, statement):
        return self.server.sql(self.database, statement)

    def wait_for_nodes(self, count):
        """The rows of all nodes, once there are so many."""
        serving = next(node for node in self.nodes if node.role != "worker")
        def rows():
            items = json_of(serving.get("/v1/nodes"))["items"]
            return items if len(items) == count else None
        return wait_until(rows, f"{count} nodes")
