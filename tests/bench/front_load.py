#!/usr/bin/python3
"""front_load.py [--idle 10000] [--slow 5000] [--streams 3000] [--seconds 10]: the front beside a crowd.

Starts whittled (from $WHITTLE_BIN) on free ports with an empty data folder. A process of its own holds the crowd:
idle connections, others whose request head comes a byte a second (and begins anew when it is given up), and listeners
to /v1/events. Another one asks GET /v1/version again and again over new connections, alone and then beside the crowd,
while a job is submitted each second. Told are the latencies, the front's memory, and what the listeners heard.
"""
import argparse
import json
import multiprocessing
import pathlib
import resource
import selectors
import socket
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))
from tests.http.daemon import Daemon, scene  # pylint: disable=wrong-import-position

HEAD = b"GET /v1/version HTTP/1.1\r\nHost: localhost\r\nX-Padding: " + b"x" * 4000


def connect(port):
    connection = socket.create_connection(("127.0.0.1", port), timeout=60)
    connection.setblocking(False)
    return connection


class Crowd(multiprocessing.Process):
    """All the connections, in one process; it tells through `pipe` that they are there, and in the end what it saw."""

    def __init__(self, port, sizes, pipe):
        super().__init__(daemon=True)
        self.port, self.sizes, self.pipe = port, sizes, pipe
        self.selector = selectors.DefaultSelector()
        self.slow, self.heard, self.given_up, self.closed = {}, 0, 0, 0

    def add_slow(self):
        connection = connect(self.port)
        self.slow[connection] = 0
        self.selector.register(connection, selectors.EVENT_READ, "slow")

    def run(self):
        for _ in range(self.sizes.idle):
            self.selector.register(connect(self.port), selectors.EVENT_READ, "idle")
        for _ in range(self.sizes.streams):
            connection = connect(self.port)
            connection.sendall(b"GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n")
            self.selector.register(connection, selectors.EVENT_READ, "stream")
        for _ in range(self.sizes.slow):
            self.add_slow()
        self.pipe.send("here")
        next_drip = time.monotonic()
        while not self.pipe.poll():
            if time.monotonic() >= next_drip:
                next_drip += 1
                self.drip()
            for key, _ in self.selector.select(max(0, next_drip - time.monotonic())):
                self.read(key)
        self.pipe.send({"events heard": self.heard, "slow heads given up": self.given_up, "others closed": self.closed})

    def drip(self):
        for connection, sent in list(self.slow.items()):
            try:
                self.slow[connection] += connection.send(HEAD[sent:sent + 1])
            except OSError:
                pass  # its answer is about to be read

    def read(self, key):
        try:
            text = key.fileobj.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            text = b""
        if key.data == "stream":
            self.heard += text.count(b"\nevent: ")
        if text and key.data != "slow":
            return
        self.selector.unregister(key.fileobj)
        key.fileobj.close()
        if key.data == "slow":
            del self.slow[key.fileobj]
            self.given_up += 1
            self.add_slow()
        else:
            self.closed += 1


def latencies(port, seconds, results):
    """Milliseconds of each GET until `seconds` are over."""
    taken, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        begin = time.monotonic()
        with socket.create_connection(("127.0.0.1", port), timeout=60) as connection:
            connection.sendall(b"GET /v1/version HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            if not connection.recv(15).startswith(b"HTTP/1.1 200"):
                raise AssertionError("refused")
        taken.append((time.monotonic() - begin) * 1000)
        time.sleep(0.002)
    results.send(sorted(taken))


def measure(daemon, seconds, job_each_second):
    """The latencies, asked for by a process of its own, and how many jobs were submitted meanwhile."""
    ours, theirs = multiprocessing.Pipe()
    asking = multiprocessing.Process(target=latencies, args=(daemon.port, seconds, theirs), daemon=True)
    asking.start()
    jobs = 0
    while not ours.poll(1):
        if job_each_second:
            daemon.submit(scene())
            jobs += 1
    asking.join()
    return ours.recv(), jobs


def tell(what, taken):
    def share(part):
        return taken[min(len(taken) - 1, int(len(taken) * part))]
    print(f"  GET {what}: {len(taken)} requests, p50 {share(.5):.1f} ms, p99 {share(.99):.1f} ms, worst {taken[-1]:.1f} ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, default in (("idle", 10_000), ("slow", 5_000), ("streams", 3_000), ("seconds", 10)):
        parser.add_argument(f"--{name}", type=int, default=default)
    sizes = parser.parse_args()
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    with Daemon(environment={"WHITTLE_LOG_LEVEL": "warning"}) as daemon:
        alone = daemon.resident_bytes()
        taken, _ = measure(daemon, min(sizes.seconds, 5), False)
        print(f"front: {sizes.idle} idle connections, {sizes.slow} slow heads, {sizes.streams} event streams")
        tell("alone", taken)
        pipe, theirs = multiprocessing.Pipe()
        crowd = Crowd(daemon.port, sizes, theirs)
        crowd.start()
        pipe.recv()
        taken, jobs = measure(daemon, sizes.seconds, True)
        tell("beside the crowd", taken)
        held = daemon.resident_bytes()
        print(f"  memory: {alone / 2**20:.1f} MiB alone, {held / 2**20:.1f} MiB beside the crowd")
        pipe.send("enough")
        print(f"  jobs submitted meanwhile: {jobs}; the crowd: {json.dumps(pipe.recv())}")
        crowd.join()


if __name__ == "__main__":
    main()
