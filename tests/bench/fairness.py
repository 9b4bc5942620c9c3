#!/usr/bin/env -S /usr/bin/python3 -u
"""Latency of small renders of one API key while another key floods the queue.

    tests/bench/fairness.py [--bin DIRECTORY] [--jobs 10000] [--endless 3] [--seconds 20]

The flooding key submits a batch of --jobs small renders and --endless jobs of 40 x 25 pixels between mirrors that do not
end. The other key then sends POST /v1/render one after the other for --seconds. Goal: p99 500 ms.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
# pylint: disable=wrong-import-position
from tests.bench.service import Connection, Service, percentiles, timed
from tests.http.daemon import json_of, scene
from tests.support.whittle import BIN


def endless_scene():
    """Looks small, and traces a million bounces for each sample."""
    mirror = {"color": 0, "reflection": 1}
    walls = [{"type": "plane", "point": [x, y, z], "normal": [-x, -y, -z], "material": mirror}
             for x, y, z in ((2, 0, 0), (-2, 0, 0), (0, 2, 0), (0, -2, 0), (0, 0, 9), (0, 0, -2))]
    return scene(40, 25, objects=walls, accuracy={"samples": [1000, 1000], "max_depth": 1_000_000, "cutoff": 0})


def request_of(path, document, key):
    body = json.dumps(document).encode()
    return (f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nAuthorization: Bearer {key}\r\n"
            f"Content-Length: {len(body)}\r\n\r\n").encode() + body


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=BIN)
    parser.add_argument("--jobs", type=int, default=10_000)
    parser.add_argument("--endless", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=20)
    options = parser.parse_args()
    with Service(options.bin, keys=("flood", "other")) as service:
        flood, other = service.keys
        connection = Connection(service.port)
        for _ in range(options.endless):
            assert connection.exchange(request_of("/v1/jobs", endless_scene(), flood))[0] == 202
        batch = {"scene": scene(64, 48, job={"cache": "off"}), "frames": [{}] * options.jobs}
        (status, _), submission_ms = timed(lambda: connection.exchange(request_of("/v1/batches", batch, flood)))
        assert status == 202, status
        latencies_ms, until = [], time.monotonic() + options.seconds
        request = request_of("/v1/render", scene(16, 16), other)
        while time.monotonic() < until:
            (status, _), latency_ms = timed(lambda: connection.exchange(request))
            assert status == 200, status
            latencies_ms.append(latency_ms)
        connection.close()
        depth = json_of(service.get("/v1/queue", Authorization=f"Bearer {other}"))
        print(f"batch of {options.jobs}: {submission_ms:.0f} ms")
        print(f"{len(latencies_ms)} renders of the other key, ms:", end=" ")
        print(*(f"{name.split(', ')[-1]} {value:.1f}" for name, value in percentiles("", latencies_ms).items()),
              f"max {max(latencies_ms):.1f}", sep=", ")
        print("jobs:", depth["jobs"])


if __name__ == "__main__":
    main()
