#!/usr/bin/python3
"""first_byte.py [--rounds 200] [--scene scenes/tiny.json] [--size 64] [options of whittled]: how long one who waits
for a small picture waits, and how much of that is neither building, tracing nor encoding.

Starts whittled (from $WHITTLE_BIN) on free ports with an empty data folder. One client with one kept connection asks, turn
by turn, by POST /v1/render until the first byte of the picture, and by POST /v1/jobs and GET ?wait until the job has ended.
The job's own report tells what the worker was busy with: `service` is all the rest, HTTP, durable queue, both processes'
messages, store. Each time the camera stands elsewhere: no picture is there already. Beside it stand how long the same
client waits for GET /v1/version, which is the HTTP and its own share, and how long this machine takes to make 4 KiB last, for
which POST /v1/jobs waits twice, and POST /v1/render for no picture up to 32 KiB.
"""
import argparse
import itertools
import json
import os
import pathlib
import socket
import statistics
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))
from tests.http.daemon import Daemon  # pylint: disable=wrong-import-position

STAGES = ("queue", "parse", "build", "trace", "encode")


class Connection:
    """HTTP written out by hand, so that the client costs next to nothing."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.stream = self.socket.makefile("rb")

    def ask(self, method, path, body=b"", accept="application/json"):
        """(status, headers, body, seconds until the answer began)"""
        head = (f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nAccept: {accept}\r\nContent-Type: application/json\r\n"
                f"Content-Length: {len(body)}\r\n\r\n")
        start = time.perf_counter()
        self.socket.sendall(head.encode() + body)
        status = int(self.stream.readline().split()[1])
        seconds = time.perf_counter() - start
        headers = {}
        while (line := self.stream.readline()) not in (b"\r\n", b""):
            name, _, value = line.decode().partition(":")
            headers[name.lower()] = value.strip()
        return status, headers, self.stream.read(int(headers["content-length"])), seconds


def expect(wanted, answer):
    if answer[0] != wanted:
        sys.exit(f"answered {answer[0]}: {answer[2][:500]!r}")
    return answer


def stages_of(connection, path):
    """Milliseconds of the worker's stages, by the job's report."""
    job = json.loads(expect(200, connection.ask("GET", path))[2])
    return {name: job["report"]["time_ms"][name] for name in STAGES}


def by_render(connection, document):
    _, headers, _, seconds = expect(200, connection.ask("POST", "/v1/render", document, "image/png"))
    return 1000 * seconds, headers["content-location"].rsplit("/", 1)[0]


def by_waiting(connection, document):
    start = time.perf_counter()
    job = json.loads(expect(202, connection.ask("POST", "/v1/jobs", document))[2])
    path = f"/v1/jobs/{job['id']}"
    job = json.loads(expect(200, connection.ask("GET", path + "?wait=60"))[2])
    if job["state"] != "succeeded":
        sys.exit(f"the job is {job['state']}")
    return 1000 * (time.perf_counter() - start), path


def fsync_ms(folder, rounds):
    taken = []
    for _ in range(rounds):
        with open(pathlib.Path(folder) / "file", "ab") as file:
            file.write(bytes(4096))
            start = time.perf_counter()
            os.fsync(file.fileno())
            taken.append(1000 * (time.perf_counter() - start))
    return statistics.median(taken)


def tell(what, rows):
    print(f"{what:22} {'p50':>8} {'p90':>8} {'p99':>8} {'least':>8}")
    for name in rows[0]:
        values = sorted(row[name] for row in rows)
        at = [values[min(len(values) - 1, int(part * len(values)))] for part in (0.5, 0.9, 0.99)]
        print(f"  {name:20} " + " ".join(f"{value:8.2f}" for value in (*at, values[0])))


def documents(scene):
    """Of pictures that differ, without end."""
    for step in itertools.count():
        position = [scene["camera"]["position"][0] + 1e-3 * step, *scene["camera"]["position"][1:]]
        yield json.dumps({**scene, "camera": {**scene["camera"], "position": position}}).encode()


def version_ms(connection, rounds):
    return statistics.median(1000 * expect(200, connection.ask("GET", "/v1/version"))[3] for _ in range(rounds))


def measure(connection, frames, rounds, way):
    rows = []
    for _ in range(rounds):
        total, path = way(connection, next(frames))
        stages = stages_of(connection, path)
        service = total - sum(stages[name] for name in ("build", "trace", "encode"))
        rows.append({"total": total, **stages, "service": service})
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=200)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--scene", default=str(pathlib.Path(__file__).parents[2] / "scenes" / "tiny.json"))
    options, of_the_daemon = parser.parse_known_args()
    scene = json.loads(pathlib.Path(options.scene).read_bytes())
    scene["image"] = {"width": options.size, "height": options.size}
    scene["job"] = {**scene.get("job", {}), "cache": "off"}  # each is rendered
    frames = documents(scene)
    print(f"{pathlib.Path(options.scene).name} {options.size} x {options.size}, {len(next(frames))} bytes, {options.rounds} rounds, "
          f"load {os.getloadavg()[0]:.1f}; milliseconds")
    with Daemon("--log-level", "warning", *of_the_daemon) as daemon:
        connection = Connection(daemon.port)
        for way in (by_render, by_waiting):
            measure(connection, frames, 10, way)  # warm
        tell("POST /v1/render", measure(connection, frames, options.rounds, by_render))
        tell("POST /v1/jobs, wait", measure(connection, frames, options.rounds, by_waiting))
        print(f"GET /v1/version: {version_ms(connection, options.rounds):.2f}")
    with tempfile.TemporaryDirectory() as folder:
        print(f"fsync of 4 KiB here: {fsync_ms(folder, 50):.2f}")


if __name__ == "__main__":
    main()
