"""A `whittled` of any build with an empty data directory, and raw HTTP clients that cost little CPU time."""
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time

from tests.http.daemon import PATIENCE_S, Served

# Neither quota nor log output affects the figures.
OPTIONS = ("--log-level", "warning", "--queued-jobs", "10000000", "--key-queued-jobs", "10000000")


class Service(Served):
    """The daemon of one build on free ports, with an API key for each name. Its output is not checked, so that it may be
    an older version."""

    def __init__(self, directory, keys=()):
        self.data = pathlib.Path(tempfile.mkdtemp(prefix="whittle-load-"))
        self.keys = [subprocess.run([directory / "whittled", "--new-key", name, "--keys", self.data / "keys"], check=True,
                                    capture_output=True, text=True).stdout.strip() for name in keys]
        with_keys = ("--keys", self.data / "keys") if keys else ()
        environment = {name: value for name, value in os.environ.items() if not name.startswith("WHITTLE_")}
        with open(self.data / "log", "wb") as log:
            # pylint: disable-next=consider-using-with
            self.process = subprocess.Popen([directory / "whittled", "--listen", "127.0.0.1:0", "--health-listen",
                                             "127.0.0.1:0", "--data", self.data / "data", *OPTIONS, *with_keys],
                                            stdout=subprocess.PIPE, stderr=log, env=environment, start_new_session=True)
        self.port, self.health_port = self.read_port(), self.read_port()

    def read_port(self):
        found = re.search(rb"127\.0\.0\.1:(\d+)", self.process.stdout.readline())
        if not found:
            sys.exit(f"whittled does not start: {(self.data / 'log').read_text('utf-8')}")
        return int(found[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait(PATIENCE_S)
        self.process.stdout.close()
        shutil.rmtree(self.data)

    def resident_mib(self):
        pages = self.proc("statm").read_text("ascii").split()[1]
        return int(pages) * os.sysconf("SC_PAGESIZE") / 2**20

    def cpu_seconds(self):
        """CPU time of the daemon and its workers so far."""
        children = [pid for task in self.proc("task").iterdir() for pid in (task / "children").read_text("ascii").split()]
        stats = [pathlib.Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
                 for pid in (self.process.pid, *children)]
        return sum(int(ticks) for fields in stats for ticks in fields[11:13]) / os.sysconf("SC_CLK_TCK")

    def proc(self, name):
        return pathlib.Path(f"/proc/{self.process.pid}/{name}")


class Connection:
    """One kept connection with one request at a time."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.stream = self.socket.makefile("rb")

    def exchange(self, request):
        """(status, body) of the response."""
        self.socket.sendall(request)
        status, length = int(self.stream.readline().split()[1]), 0
        while (line := self.stream.readline()) not in (b"\r\n", b""):
            name, _, value = line.partition(b":")
            if name.lower() == b"content-length":
                length = int(value)
        return status, self.stream.read(length)

    def close(self):
        self.stream.close()
        self.socket.close()


def post(path, document):
    body = json.dumps(document).encode()
    return (f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(body)}\r\n\r\n").encode() + body


def get(path):
    return f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()


def timed(call):
    """(result, milliseconds)"""
    start = time.perf_counter()
    result = call()
    return result, 1000 * (time.perf_counter() - start)


class Client(threading.Thread):
    """Repeats one request until a point in time. With `reconnect` each request has a connection of its own."""

    def __init__(self, port, request, until, pause_s, reconnect):
        super().__init__()
        self.port, self.request, self.until, self.pause_s, self.reconnect = port, request, until, pause_s, reconnect
        self.latencies_ms, self.rejected = [], 0

    def run(self):
        connection = None if self.reconnect else Connection(self.port)
        while time.monotonic() < self.until:
            try:
                (status, _), latency_ms = timed(lambda: self.exchange(connection))
            except (OSError, IndexError):  # the daemon closed the connection
                self.rejected += 1
                break
            if status in (200, 202):
                self.latencies_ms.append(latency_ms)
            else:
                self.rejected += 1
            time.sleep(self.pause_s)
        if connection:
            connection.close()

    def exchange(self, connection):
        if connection:
            return connection.exchange(self.request)
        connection = Connection(self.port)
        try:
            return connection.exchange(self.request)
        finally:
            connection.close()


def latencies_under_load(service, request, seconds, clients=1, pause_s=0.0, reconnect=False):
    """(requests per second, sorted latencies in milliseconds) of that many clients. Ends the program if one is rejected."""
    start = time.monotonic()
    threads = [Client(service.port, request, start + seconds, pause_s, reconnect) for _ in range(clients)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    latencies_ms = sorted(latency for thread in threads for latency in thread.latencies_ms)
    rejected = sum(thread.rejected for thread in threads)
    if rejected or not latencies_ms:
        sys.exit(f"{rejected} requests were rejected, {len(latencies_ms)} succeeded")
    return len(latencies_ms) / (time.monotonic() - start), latencies_ms


def percentiles(name, latencies_ms, shares=(0.5, 0.99)):
    """{"NAME p50 ms": ..., "NAME p99 ms": ...}"""
    ordered = sorted(latencies_ms)
    return {f"{name}, p{round(100 * share)} ms": ordered[min(len(ordered) - 1, int(share * len(ordered)))]
            for share in shares}
