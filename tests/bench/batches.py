#!/usr/bin/env -S /usr/bin/python3 -u
"""Cost of a large batch: time of its submission, memory of the daemon, and reads by others meanwhile.

    tests/bench/batches.py [--bin DIRECTORY] [--frames 10000] [--materials 4000] [--batches 1]

The scene has --materials materials (4,000 are 1 MB) and each frame another camera. --batches connections submit one each at
the same time, while another connection reads GET /v1/version. Goal: 5 s, 200 MB, p99 of the reads 50 ms.
"""
import argparse
import pathlib
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
# pylint: disable=wrong-import-position
from tests.bench.service import Connection, Service, get, percentiles, post, timed
from tests.http.daemon import scene
from tests.support.whittle import BIN


def long_scene(materials):
    named = {f"material {i}": {"color": [i / materials, 0.5, 0.25], "diffuse": 0.8, "specular": 0.125, "shininess": 20 + i,
                               "specular_color": [1, 1, 1], "reflection": 0.125, "reflection_color": [0.5, 0.5, 1],
                               "emission": [0, 0, 0], "absorption": [0.1, 0.2, 0.3], "ior": 1.5}
             for i in range(materials)}
    return scene(materials=named, job={"run_after": "2999-01-01T00:00:00Z"})


def peak_mib(service):
    status = service.proc("status").read_text("ascii").splitlines()
    return next(int(line.split()[1]) for line in status if line.startswith("VmHWM:")) / 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=BIN)
    parser.add_argument("--frames", type=int, default=10_000)
    parser.add_argument("--materials", type=int, default=4_000)
    parser.add_argument("--batches", type=int, default=1)
    options = parser.parse_args()
    frames = [{"camera": {"fov": 20 + 60 * i / options.frames}} for i in range(options.frames)]
    request = post("/v1/batches", {"scene": long_scene(options.materials), "frames": frames})
    with Service(options.bin) as service:
        times_ms, reads_ms = [], []

        def submit():
            connection = Connection(service.port)
            (status, body), duration_ms = timed(lambda: connection.exchange(request))
            assert status == 202, body[:500]
            times_ms.append(duration_ms)

        before_mib, start_cpu_s = service.resident_mib(), service.cpu_seconds()
        threads = [threading.Thread(target=submit) for _ in range(options.batches)]
        for thread in threads:
            thread.start()
        reader = Connection(service.port)
        while any(thread.is_alive() for thread in threads):
            reads_ms.append(timed(lambda: reader.exchange(get("/v1/version")))[1])
            time.sleep(0.001)
        print(f"request: {len(request) / 1e6:.1f} MB; {options.frames} frames; submissions: "
              + ", ".join(f"{duration_ms:.0f}" for duration_ms in sorted(times_ms)) + " ms")
        print(f"CPU {service.cpu_seconds() - start_cpu_s:.1f} s, memory before {before_mib:.0f}, peak {peak_mib(service):.0f} MiB, "
              f"after {service.resident_mib():.0f} MiB")
        print(f"{len(reads_ms)} reads meanwhile, ms:",
              ", ".join(f"{name.split(', ')[-1]} {value:.1f}" for name, value in percentiles("", reads_ms).items()),
              f"max {max(reads_ms):.1f}")


if __name__ == "__main__":
    main()
