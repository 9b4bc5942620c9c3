#!/usr/bin/python3
"""jobs_bench.py [--seconds 10] [--clients 8] [--scene scenes/tiny.json]: jobs per second through a real daemon.

Starts whittled (from $WHITTLE_BIN) on free ports with an empty data folder. Each client has one connection and posts
the scene to /v1/render again and again, waiting for each picture: durable job, worker, encoder and store are all in it.
Told are pictures per second, their latency, what was refused, and what was lost: accepted jobs that did not succeed.
The clients share the machine with the daemon. The resident memory is the daemon's alone, before the first request.
"""
import argparse
import json
import pathlib
import socket
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))
from tests.http.daemon import Daemon  # pylint: disable=wrong-import-position


class Client(threading.Thread):
    """One connection, one request at a time, written out by hand so that it costs next to nothing."""

    def __init__(self, port, document, until):
        super().__init__()
        self.stream = socket.create_connection(("127.0.0.1", port), timeout=60).makefile("rwb")
        self.request = (b"POST /v1/render HTTP/1.1\r\nHost: localhost\r\nAccept: image/png\r\n"
                        b"Content-Type: application/json\r\nContent-Length: %d\r\n\r\n" % len(document)) + document
        self.until = until
        self.latencies_s, self.refused = [], 0

    def answer(self):
        """(status, whether it is a PNG)"""
        status = int(self.stream.readline().split()[1])
        length = 0
        while (line := self.stream.readline()) not in (b"\r\n", b""):
            name, _, value = line.partition(b":")
            if name.lower() == b"content-length":
                length = int(value)
        return status, self.stream.read(length).startswith(b"\x89PNG")

    def run(self):
        while time.monotonic() < self.until:
            start = time.monotonic()
            self.stream.write(self.request)
            self.stream.flush()
            status, is_picture = self.answer()
            if status == 200 and is_picture:
                self.latencies_s.append(time.monotonic() - start)
            else:
                self.refused += 1


def count_jobs(daemon):
    """{state: how many} over every job the daemon ever accepted."""
    states, cursor = {}, ""
    while cursor is not None:
        page = json.loads(daemon.get("/v1/jobs?limit=200" + (f"&cursor={cursor}" if cursor else "")).body)
        for job in page["items"]:
            states[job["state"]] = states.get(job["state"], 0) + 1
        cursor = page["next_cursor"]
    return states


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--clients", type=int, default=8)
    parser.add_argument("--scene", default=str(pathlib.Path(__file__).parents[2] / "scenes" / "tiny.json"))
    options = parser.parse_args()
    scene = json.loads(pathlib.Path(options.scene).read_bytes())
    scene["job"] = {**scene.get("job", {}), "cache": "off"}  # each is rendered
    document = json.dumps(scene).encode()

    with Daemon("--log-level", "warning") as daemon:
        idle_bytes = daemon.resident_bytes()
        start = time.monotonic()
        clients = [Client(daemon.port, document, start + options.seconds) for _ in range(options.clients)]
        for client in clients:
            client.start()
        for client in clients:
            client.join()
        seconds = time.monotonic() - start
        states = count_jobs(daemon)

    latencies = sorted(latency for client in clients for latency in client.latencies_s)
    if not latencies:
        sys.exit("no picture came back")
    lost = sum(states.values()) - states.get("succeeded", 0)
    at = lambda part: 1000 * latencies[min(len(latencies) - 1, int(part * len(latencies)))]
    print(f"{pathlib.Path(options.scene).name}, {options.clients} clients, {seconds:.1f} s")
    print(f"jobs       {len(latencies) / seconds:.0f} /s  ({len(latencies)} pictures)")
    print(f"latency    p50 {at(0.5):.1f} ms, p99 {at(0.99):.1f} ms, max {at(1):.1f} ms")
    print(f"refused    {sum(client.refused for client in clients)}")
    print(f"lost       {lost}  (of {sum(states.values())} accepted)")
    print(f"idle       {idle_bytes / 2**20:.1f} MiB resident, the daemon")
    sys.exit(1 if lost else 0)


if __name__ == "__main__":
    main()
