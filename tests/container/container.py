"""A container of the daemon, spoken to from within its own network: nothing of it need be reachable from outside."""
import contextlib
import ctypes
import errno
import http.client
import json
import os
import pathlib
import socket
import tempfile

from tests.container.engine import attempt, podman
from tests.http.daemon import PATIENCE_S, Served, wait_until

CLONE_NEWNET = 0x40000000  # linux/sched.h
CONFINED = ("--read-only", "--cap-drop", "all", "--security-opt", "no-new-privileges")


def enter_network(descriptor):
    """Moves the calling thread alone."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.setns(descriptor, CLONE_NEWNET) != 0:
        raise OSError(ctypes.get_errno(), "setns")


def connect_inside(pid, address):
    """A connection to `address` as the process `pid` would make it; the socket stays where it was made."""
    with open(f"/proc/{pid}/ns/net", "rb") as there, open("/proc/thread-self/ns/net", "rb") as here:
        enter_network(there.fileno())
        try:
            return socket.create_connection(address, timeout=PATIENCE_S)
        finally:
            enter_network(here.fileno())


class InsideConnection(http.client.HTTPConnection):
    def __init__(self, pid, address):
        super().__init__(*address, timeout=PATIENCE_S)
        self.pid = pid

    def connect(self):
        self.sock = connect_inside(self.pid, (self.host, self.port))


class Running(Served):
    """The daemon of a container that runs already."""

    port, health_port = 8080, 8081

    def __init__(self, name):
        self.name = name

    @property
    def pid(self):
        return self.inspect()["State"]["Pid"]  # 0 when it has ended

    def connection(self, port):
        return InsideConnection(self.pid, ("127.0.0.1", port))

    def until_ready(self):
        def ready():
            if not self.pid:
                raise AssertionError(f"{self.name} ended:\n{self.log()}")
            try:
                return self.health("/readyz").status == 200
            except (OSError, http.client.HTTPException):
                return False  # it does not listen yet
        wait_until(ready, f"{self.name} to be ready")
        return self

    def log(self):
        done = attempt("logs", self.name)
        return done.stdout + done.stderr

    def worker_pids(self):
        children = pathlib.Path(f"/proc/{self.pid}/task").glob("*/children")
        return [int(pid) for path in children for pid in path.read_text(encoding="ascii").split()]

    def exit_code(self):
        """Once it has ended."""
        return int(podman("wait", self.name))

    def inspect(self):
        return json.loads(podman("inspect", self.name))[0]

    def can_write(self, directory):
        """True if root, whom no permission holds, could write there as the container sees it."""
        try:
            os.rmdir(tempfile.mkdtemp(dir=f"/proc/{self.pid}/root{directory}"))
            return True
        except OSError as failure:
            if failure.errno != errno.EROFS:
                raise
            return False


class Container(Running, contextlib.AbstractContextManager):
    """Made of `image`, confined as everywhere; gone again after use as a context manager, its anonymous volume too."""

    def __init__(self, image, *options):
        super().__init__(podman("run", "--detach", *CONFINED, *options, image))
        try:
            self.until_ready()
        except BaseException:
            self.__exit__()
            raise

    def __exit__(self, *_):
        podman("rm", "--force", "--time", "0", "--volumes", self.name)

    def start(self):
        """Again, after its end."""
        podman("start", self.name)
        return self.until_ready()
