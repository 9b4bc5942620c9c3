#!/usr/bin/python3
"""cancel_bench.py [--rounds 40] [--kinds NAME ...] [options of whittled]: how long a cancel takes, whatever a job does.

Starts whittled (from $WHITTLE_BIN) on free ports with an empty data folder and one place for jobs. Jobs of several kinds,
each long in another stage, are cancelled at random moments between their start and their end while another job waits.
Told for each kind and stage, in milliseconds from the request to cancel on: until it was answered, until the job's state
was `cancelled`, until the job that waited had begun. A spare worker is ready each time, but with --storm. Of a kind's stage it is known what an undisturbed run spent in it:
a moment's stage is that in which the run was then. `killed` counts workers that were replaced because they did not stop.
"""
import argparse
import collections
import hashlib
import json
import os
import pathlib
import random
import struct
import sys
import time
import zlib
from datetime import datetime

sys.path.insert(0, str(pathlib.Path(__file__).parents[2]))
from tests.http.daemon import Daemon, scene, wait_until  # pylint: disable=wrong-import-position

STAGES = ("parse", "build", "trace", "encode")


# ---- what to render
# ---------------------------------------------------------------------------------------------------------

def grid(side):
    """Positions and triangles of a wavy square of 2 x side x side triangles."""
    positions = [(x / side - 0.5, 0.05 * ((x * 7919 + y * 104729) % 97) / 97, y / side - 0.5)
                 for y in range(side + 1) for x in range(side + 1)]
    triangles = []
    for y in range(side):
        for x in range(side):
            i = y * (side + 1) + x
            triangles += [(i, i + side + 1, i + 1), (i + 1, i + side + 1, i + side + 2)]
    return positions, triangles


def ply(side):
    positions, triangles = grid(side)
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\nproperty float x\nproperty float y\n"
            f"property float z\nelement face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    return (head.encode() + b"".join(struct.pack("<3f", *p) for p in positions)
            + b"".join(struct.pack("<B3i", 3, *t) for t in triangles))


def stl(side):
    positions, triangles = grid(side)
    rows = [struct.pack("<12fH", 0, 0, 0, *positions[a], *positions[b], *positions[c], 0) for a, b, c in triangles]
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(rows)


def glb(side):
    positions, triangles = grid(side)
    corners = b"".join(struct.pack("<3f", *p) for p in positions)
    indices = b"".join(struct.pack("<3I", *t) for t in triangles)
    text = json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(corners) + len(indices)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(corners)},
                        {"buffer": 0, "byteOffset": len(corners), "byteLength": len(indices)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3",
                       "min": [-1, -1, -1], "max": [1, 1, 1]},
                      {"bufferView": 1, "componentType": 5125, "count": 3 * len(triangles), "type": "SCALAR"}]}).encode()
    text += b" " * (-len(text) % 4)
    binary = corners + indices
    return (struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary)) + struct.pack("<I4s", len(text), b"JSON")
            + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


def png(side):
    """Noise, which takes a decoder longest."""
    rows = b"".join(b"\0" + random.Random(y).randbytes(3 * side) for y in range(side))

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))


def with_object(shape, **changes):
    return scene(64, 48, objects=[*scene()["objects"], shape], **changes)


def mesh_of(name):
    return with_object({"type": "mesh", "file": name, "smooth": True, "material": {"color": 0.5}})


def document_mesh(side):
    positions, triangles = grid(side)
    return with_object({"type": "mesh", "positions": positions, "triangles": triangles, "material": {"color": 0.5}})


def textured(name):
    material = {"color": "picture"}
    return scene(64, 48, textures={"picture": {"file": name}},
                 objects=[{"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5, "material": material}])


def mirrors():
    return [{"type": "sphere", "center": [x, 0.5, z], "radius": 0.5, "material": {"color": 0.5, "reflection": 0.8}}
            for x in (-0.6, 0.6) for z in (-0.6, 0.6)]


def kinds(upload, size):
    """{name: body of POST /v1/jobs}; `upload` gives the name of a file's bytes, `size` is 1 for the real thing."""
    side = max(4, int(700 * size))
    return {
        "10 MB of JSON": lambda: document_mesh(max(4, int(290 * size))),
        "PLY": lambda: mesh_of(upload(ply(side))),
        "STL": lambda: mesh_of(upload(stl(side))),
        "GLB": lambda: mesh_of(upload(glb(side))),
        "PNG texture": lambda: textured(upload(png(max(16, int(4000 * size))))),
        "tracing": lambda: scene(max(16, int(1200 * size)), max(16, int(900 * size)), samples=16, objects=mirrors()),
        "adaptive": lambda: scene(max(16, int(800 * size)), max(16, int(600 * size)), objects=mirrors(),
                                  accuracy={"target_error": 0.3}),
        "encoding": lambda: scene(max(16, int(5000 * size)), max(16, int(4000 * size)), output={"formats": ["png", "exr"]}),
    }


# ---- cancelled
# --------------------------------------------------------------------------------------------------------------

def uploader(daemon):
    def upload(data):
        sha256 = hashlib.sha256(data).hexdigest()
        reply = daemon.request("PUT", f"/v1/assets/{sha256}", data)
        assert reply.status in (200, 201), reply.body
        return f"sha256:{sha256}"
    return upload


def unix_ms(text):
    return 1000 * datetime.fromisoformat(text.replace("Z", "+00:00")).timestamp()


def wait_running(daemon, job_id):
    while True:
        job = daemon.job(job_id)
        if job["state"] != "queued":
            return job
        time.sleep(0.001)


def stage_at(report, elapsed_ms):
    for stage in STAGES:
        elapsed_ms -= report["time_ms"][stage]
        if elapsed_ms <= 0:
            return stage
    return "settle"


def cancel_once(daemon, body, elapsed_s):
    """Milliseconds until (the answer, the state, the next job's start); nothing where the job was faster."""
    job_id = daemon.submit(body)
    waiting = daemon.submit(scene(name="waits"))
    job = wait_running(daemon, job_id)
    time.sleep(max(0, unix_ms(job["started_at"]) / 1000 + elapsed_s - time.time()) if job["started_at"] else 0)
    start = time.time()
    reply = daemon.request("POST", f"/v1/jobs/{job_id}/cancel")
    answered = time.time()
    if reply.status == 409:
        daemon.wait_for_end(waiting)
        return None
    while (job := daemon.job(job_id))["state"] == "running":
        time.sleep(0.001)
    ended = time.time()
    next_job = daemon.wait_for_end(waiting)
    assert next_job["state"] == "succeeded" and next_job["attempt"] == 1, next_job
    if job["state"] != "cancelled":
        return None
    return 1000 * (answered - start), 1000 * (ended - start), max(0, unix_ms(next_job["started_at"]) - 1000 * start)


def workers_killed(daemon):
    return sum(row["event"] == "worker_ended" for row in daemon.log_rows())


def spare_is_ready(daemon):
    """Workers are held by seccomp from the moment on that they are ready."""
    states = [pathlib.Path(f"/proc/{pid}/status").read_text("ascii") for pid in daemon.worker_pids()]
    return len(states) == 2 and all("Seccomp:\t2" in state for state in states)


def undisturbed(daemon, body):
    """The job of a run to the end, or to where nobody waits longer."""
    job = daemon.wait_for_end(daemon.submit(body))
    assert job["state"] == "succeeded", job["problem"]
    return job


def tell(name, rows):
    values = [f"{name:26} {len(rows):4}"]
    for column in zip(*rows):
        ordered = sorted(column)
        values.append(" ".join(f"{ordered[min(len(ordered) - 1, int(part * len(ordered)))]:7.1f}" for part in (0.5, 0.99, 1)))
    print("   ".join(values), flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument("--size", type=float, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="*")
    parser.add_argument("--storm", action="store_true")
    options, of_the_daemon = parser.parse_known_args()
    chance = random.Random(options.seed)
    print(f"{options.rounds} rounds of each kind, load {os.getloadavg()[0]:.1f}; milliseconds, p50 p99 max of each")
    print(f"{'':26} {'':4}   {'answered':^23}   {'cancelled':^23}   {'next job begun':^23}")
    everything = []
    with Daemon("--jobs", "1", *of_the_daemon) as daemon:
        for name, body_of in kinds(uploader(daemon), options.size).items():
            if options.kinds and name not in options.kinds:
                continue
            body = body_of()
            job = undisturbed(daemon, body)
            length_s = (unix_ms(job["ended_at"]) - unix_ms(job["started_at"])) / 1000
            killed, stages = workers_killed(daemon), collections.defaultdict(list)
            for _ in range(options.rounds):
                elapsed_s = chance.uniform(0, length_s)
                if not options.storm:
                    wait_until(lambda: spare_is_ready(daemon), "a spare worker")
                row = cancel_once(daemon, body, elapsed_s)
                if row:
                    stages[stage_at(job["report"], 1000 * elapsed_s)].append(row)
            rows = [row for of_stage in stages.values() for row in of_stage]
            everything += rows
            print(f"{name}: {length_s:.2f} s undisturbed, {workers_killed(daemon) - killed} killed")
            for stage in (*STAGES, "settle"):
                if stages[stage]:
                    tell(f"  {stage}", stages[stage])
    tell("all", everything)


if __name__ == "__main__":
    main()
