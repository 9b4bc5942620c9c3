#!/usr/bin/python3
"""many_bench.py [--triangles 1000000] [--frames 60] [--side 1024] [--small 300]: many renders of one scene, and small jobs beside large.

Starts whittled (from $WHITTLE_BIN) on free ports with empty data folders. Told are
- a batch of frames of one camera around an uploaded mesh (binary PLY) before an uploaded picture (PNG), with and without
  the cache of scenes: seconds for all, milliseconds of a frame's stages, and whether the pictures are the same bytes;
- the worker's resident memory before, with the cache full, and after it gave it back;
- how soon a cancelled job lets the next one begin, whatever it was doing;
- the latency of 16 x 16 pictures, one after the other, on an idle daemon and while more large renders run and wait than
  there are places.
They mean something on a machine that does nothing else.
"""
import argparse
import hashlib
import json
import math
import os
import pathlib
import random
import struct
import sys
import time
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))
from tests.http.daemon import Daemon, json_of, long_scene, scene  # pylint: disable=wrong-import-position


def terrain(triangles):
    """A binary PLY of about so many."""
    side = int(math.sqrt(triangles / 2)) + 1
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {side * side}\nproperty float x\nproperty float y\n"
              f"property float z\nelement face {2 * (side - 1) ** 2}\nproperty list uchar int vertex_indices\nend_header\n")
    body = bytearray()
    for j in range(side):
        z = 2 * j / (side - 1) - 1
        for i in range(side):
            x = 2 * i / (side - 1) - 1
            body += struct.pack("<fff", x, 0.15 * math.sin(7 * x) * math.cos(5 * z) + 0.02 * math.sin(61 * x + 23 * z), z)
    for j in range(side - 1):
        for i in range(side - 1):
            a, b = j * side + i, (j + 1) * side + i
            body += struct.pack("<BiiiBiii", 3, a, b, a + 1, 3, a + 1, b, b + 1)
    return header.encode() + bytes(body)


def picture(side):
    """A PNG around the world of twice as many by so many pixels, as hard to decode as a photograph."""
    rows = bytearray()
    generator = random.Random(1)
    for _ in range(side):
        rows += b"\0" + generator.randbytes(3 * 2 * side)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 2 * side, side, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(bytes(rows), 1)) + chunk(b"IEND", b""))


def orbit(mesh, environment, frames):
    document = {"version": 1, "image": {"width": 320, "height": 240}, "accuracy": {"samples": [1, 1]},
                "camera": {"position": [0, 0, 0], "look_at": [0, 0, 0]},
                "lights": [{"type": "directional", "direction": [-1, -1, -0.5]}], "job": {"cache": "off"},
                "objects": [{"type": "mesh", "file": "sha256:" + mesh, "material": {"color": 0.7}}],
                "background": {"environment": {"file": "sha256:" + environment}}}
    angles = [2 * math.pi * frame / frames for frame in range(frames)]
    return {"scene": document,
            "frames": [{"camera": {"position": [2 * math.cos(angle), 1.2, 2 * math.sin(angle)], "look_at": [0, 0, 0]}} for angle in angles]}


def jobs_of(daemon, batch):
    """All of them, by their place in the batch; waits for their end."""
    while True:
        state = json_of(daemon.get(f"/v1/batches/{batch}"))
        if sum(state["jobs"].get(name, 0) for name in ("queued", "running")) == 0:
            break
        time.sleep(0.02)
    page = json_of(daemon.get(f"/v1/jobs?batch={batch}&limit=200"))
    return sorted((daemon.job(job["id"]) for job in page["items"]), key=lambda job: job["created_at"] + job["id"])


def worker_mib(daemon):
    pages = sum(int(pathlib.Path(f"/proc/{pid}/statm").read_text("ascii").split()[1]) for pid in daemon.worker_pids())
    return pages * os.sysconf("SC_PAGESIZE") / 2**20


def worker_seconds(daemon):
    """Of processors: they mean something on a busy machine too."""
    fields = [pathlib.Path(f"/proc/{pid}/stat").read_text("ascii").rpartition(")")[2].split()
              for pid in daemon.worker_pids()]
    return sum(int(of[11]) + int(of[12]) for of in fields) / os.sysconf("SC_CLK_TCK")


def uploaded(daemon, content):
    sha256 = hashlib.sha256(content).hexdigest()
    daemon.request("PUT", f"/v1/assets/{sha256}", content, {"Content-Type": "application/octet-stream"})
    return sha256


def sweep(mesh, environment, frames, cache_bytes):
    """The sha256 of each picture."""
    with Daemon("--log-level", "warning", "--scene-cache-bytes", str(cache_bytes)) as daemon:
        daemon.wait_for_end(daemon.submit(scene()))
        idle = worker_mib(daemon)
        body = orbit(uploaded(daemon, mesh), uploaded(daemon, environment), frames)
        start, worked = time.monotonic(), worker_seconds(daemon)
        reply = daemon.request("POST", "/v1/batches", body)
        if reply.status != 202:
            sys.exit(f"the batch answered {reply.status}: {reply.body.decode()}")
        jobs = jobs_of(daemon, json_of(reply)["id"])
        seconds, worked = time.monotonic() - start, worker_seconds(daemon) - worked
        full = worker_mib(daemon)
        time.sleep(2)
        after = worker_mib(daemon)
    if any(job["state"] != "succeeded" for job in jobs):
        sys.exit(f"not every frame succeeded: {[job['problem'] for job in jobs]}")
    mean = {stage: sum(job["report"]["time_ms"][stage] for job in jobs) / frames
            for stage in ("parse", "build", "trace", "encode")}
    reused = sum(job["report"]["geometry_reused"] for job in jobs)
    decoded = sum(job["report"]["pictures"]["decoded"] for job in jobs)
    print(f"cache {cache_bytes >> 20:4} MiB  {frames} frames in {seconds:.2f} s ({worked:.2f} s of processors), geometry reused by {reused}, "
          f"pictures decoded by {decoded}; "
          "ms of a frame: "
          + ", ".join(f"{stage} {ms:.1f}" for stage, ms in mean.items()))
    print(f"                worker resident: {idle:.0f} MiB idle, {full:.0f} at the end, {after:.0f} two seconds later")
    return sorted(job["artifacts"][0]["sha256"] for job in jobs)


def latencies(daemon, count):
    """Milliseconds of each, sorted."""
    document = json.dumps(scene(16, 16)).encode()
    times = []
    for _ in range(count):
        start = time.monotonic()
        reply = daemon.request("POST", "/v1/render", document, {"Accept": "image/png"})
        if reply.status != 200:
            sys.exit(f"a small picture answered {reply.status}")
        times.append(1000 * (time.monotonic() - start))
    return sorted(times)


def beside_large_ones(count):
    with Daemon("--log-level", "warning") as daemon:
        daemon.wait_for_end(daemon.submit(scene()))  # the worker is there
        for large in (0, 8):
            ids = [daemon.submit(long_scene()) for _ in range(large)]
            if ids:
                daemon.wait_for_state(ids[0], "running")
            times = latencies(daemon, count)
            at = lambda part, of=times: of[min(len(of) - 1, int(part * len(of)))]
            print(f"{large} large jobs: 16 x 16 pictures p50 {at(0.5):.1f} ms, p99 {at(0.99):.1f} ms, max {at(1):.1f} ms")
            for job in ids:
                daemon.request("POST", f"/v1/jobs/{job}/cancel")


def cancels(mesh, environment, moments):
    """Cancels a job at so many moments of its life. Told: until the client is, and until the place is free."""
    with Daemon("--log-level", "warning", "--jobs", "1", "--scene-cache-bytes", "0") as daemon:
        of_mesh = orbit(uploaded(daemon, mesh), uploaded(daemon, environment), 1)
        documents = {"mesh": {**of_mesh["scene"], **of_mesh["frames"][0]},
                     "picture": scene(6000, 4000, output={"formats": ["png", "exr"]})}
        for name, document in documents.items():
            whole = daemon.wait_for_end(daemon.submit(document))["report"]["time_ms"]
            told, free = [], []
            for moment in range(moments):
                job = daemon.submit(document)
                daemon.wait_for_state(job, "running", "succeeded")  # a small one may have ended
                time.sleep(sum(whole[stage] for stage in ("parse", "build", "trace", "encode")) / 1000 * moment / moments)
                start = time.monotonic()
                if daemon.request("POST", f"/v1/jobs/{job}/cancel").status != 202:
                    continue
                next_job = daemon.submit(scene())
                daemon.wait_for_end(job)
                told.append(1000 * (time.monotonic() - start))
                daemon.wait_for_end(next_job)
                free.append(1000 * (time.monotonic() - start))
            stages = ", ".join(f"{stage} {ms:.0f}" for stage, ms in whole.items())
            print(f"{name} cancelled at {len(told)} moments: told within {max(told):.0f} ms; next job done within "
                  f"{max(free):.0f} ms, half within {sorted(free)[len(free) // 2]:.0f} (ms: {stages})")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--side", type=int, default=1024, help="of the picture: it has twice as many columns")
    parser.add_argument("--small", type=int, default=300)
    options = parser.parse_args()
    mesh, environment = terrain(options.triangles), picture(options.side)
    print(f"a mesh of {len(mesh) >> 20} MiB, a picture of {len(environment) >> 20} MiB")
    same = sweep(mesh, environment, options.frames, 0) == sweep(mesh, environment, options.frames, 512 << 20)
    print("the same pictures" if same else "OTHER PICTURES")
    beside_large_ones(options.small)
    cancels(mesh, environment, 20)
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
