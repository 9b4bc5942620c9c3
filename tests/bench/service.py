"""A `whittled` of any build with an empty data directory, and raw HTTP clients that cost little CPU time."""
import contextlib
import json
import multiprocessing
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading
import time

from tests.http.daemon import PATIENCE_S, Daemon

# Neither quota nor log output affects the figures.
OPTIONS = ("--log-level", "warning", "--queued-jobs", "10000000", "--key-queued-jobs", "10000000")


class Service(Daemon):
    """The daemon of one build, with an API key for each name; requests have the last one."""

    def __init__(self, build, keys=()):
        # pylint: disable-next=consider-using-with
        self.key_directory = tempfile.TemporaryDirectory(prefix="whittle-load-")
        file = pathlib.Path(self.key_directory.name) / "keys"
        self.keys = [subprocess.run([build / "whittled", "--new-key", name, "--keys", file], check=True, capture_output=True,
                                    text=True).stdout.strip() for name in keys]
        self.allowed = {"Authorization": f"Bearer {self.keys[-1]}"} if keys else {}
        super().__init__(*OPTIONS, *(("--keys", file) if keys else ()),
                         wrapper=("sh", "-c", 'shift; exec "$0" "$@"', build / "whittled"))

    def __exit__(self, *error):
        super().__exit__(*error)
        self.key_directory.cleanup()

    def cpu_seconds(self):
        """CPU time of the daemon and its workers so far."""
        stats = [pathlib.Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
                 for pid in (self.process.pid, *self.worker_pids())]
        return sum(int(ticks) for fields in stats for ticks in fields[11:13]) / os.sysconf("SC_CLK_TCK")


class Crowd(multiprocessing.Process):
    """Holds `sizes.idle` connections, `sizes.slow` request heads that grow by a byte per second, and `sizes.streams` event
    streams while the context is active. When the daemon closes a head, another one takes its place."""

    def __init__(self, port, sizes):
        super().__init__(daemon=True)
        self.port, self.sizes, self.is_open = port, sizes, multiprocessing.Event()

    def __enter__(self):
        self.start()
        self.is_open.wait()
        return self

    def __exit__(self, *_):
        self.terminate()
        self.join()

    def connect(self, text=b""):
        connection = socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE_S)
        connection.sendall(text)
        return connection

    def run(self):
        head, stream = b"GET /v1/version HTTP/1.1\r\nX-Padding: ", get("/v1/events")
        held = [self.connect(text) for text in [b""] * self.sizes.idle + [stream] * self.sizes.streams]
        slow = [self.connect(head) for _ in range(self.sizes.slow)]
        self.is_open.set()
        while held or slow:
            time.sleep(1)
            for index, connection in enumerate(slow):
                try:
                    connection.send(b"x")
                except OSError:  # closed by the daemon
                    connection.close()
                    slow[index] = self.connect(head)


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


def post(path, document, key=""):
    body = json.dumps(document).encode()
    access = f"Authorization: Bearer {key}\r\n" if key else ""
    return (f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n{access}"
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
        with contextlib.closing(Connection(self.port)) as own:
            return own.exchange(self.request)


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
