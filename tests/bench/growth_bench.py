#!/usr/bin/env -S /usr/bin/python3 -u
"""How Whittle's time and memory grow: with triangles, spheres, lights, depth, pixels and threads, one at a time.

    tests/bench/growth_bench.py [WHAT ...] [--most 1000000] [--rounds 3]

WHAT is any of triangles, spheres, lights, depth, pixels, threads; all by default. --most bounds triangles (10000000 takes
2 GB and minutes) and spheres (documents end at about a million). Times are the least of the rounds, for other work on the
machine only adds to them. Peak memory is the process's, with its libraries. `a ray` is tracing time by rays times threads,
`x first` compares it with the first line's: beside it stands by how much log n grew, which is what a tree allows while
neighbouring rays meet the same of it and memory is as near. What it allows when they do not is told by Embree and nothing
else tracing the same rays on one thread (rays_bench): how many times its time a ray grew, how many times its time and its
memory, tree and geometry as given, ours are.
"""
import argparse
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench.peers import bench_scenes, programs  # pylint: disable=wrong-import-position

ONE_SAMPLE = {"samples": [1, 1], "max_depth": 5, "cutoff": 0}


def powers(least, most):
    """least, 10 least, ... up to most"""
    return [least * 10**i for i in range(1 + math.floor(math.log10(most / least) + 1e-9))]


def write_waves(triangles, path):
    """A rolling sea of about so many triangles, as binary PLY: documents cannot hold ten million."""
    cells = max(2, round(math.sqrt(triangles / 2)))
    along = numpy.linspace(-6, 6, cells + 1)
    x, z = numpy.meshgrid(along, along)
    height = 0.3 / 2.1 * numpy.sin(2.1 * x + 0.7 * z) + 0.22 / 2.9 * numpy.sin(2.9 * z - 1.3 * x + 1)
    corner = numpy.arange((cells + 1) ** 2, dtype=numpy.int32).reshape(cells + 1, cells + 1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    faces = numpy.empty(2 * cells * cells, [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"] = 3
    faces["corners"] = numpy.concatenate([numpy.stack([a, b, c], -1), numpy.stack([a, c, d], -1)]).reshape(-1, 3)
    with open(path, "wb") as file:
        file.write(b"ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
                   b"property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n"
                   % (x.size, faces.size))
        numpy.stack([x, height, z], -1).astype("<f4").tofile(file)
        faces.tofile(file)
    return faces.size


def waves(triangles, folder):
    made = bench_scenes.made("waves", ONE_SAMPLE, 2, 400, 300)
    count = write_waves(triangles, folder / "waves.ply")
    made["objects"][0] = {"type": "mesh", "file": "waves.ply", "material": "water"}
    return count, made


def triangles(folder, most):
    for count in powers(1000, most):
        yield (*waves(count, folder), {})


def spheres(_, most):
    for count in powers(1000, min(most, 900_000)) + ([900_000] if most >= 900_000 else []):
        yield count, bench_scenes.made("molecule", ONE_SAMPLE, count, 400, 300), {}


def lights(*_):
    for count in powers(1, 1000):
        made = bench_scenes.made("rings", ONE_SAMPLE, 2, 200, 150)
        made["lights"] = [{"type": "point", "intensity": 1 / count,
                           "position": [9 * math.cos(2.4 * i), 9, 9 * math.sin(2.4 * i)]} for i in range(count)]
        yield count, made, {}


def depth(*_):
    for count in (0, 1, 2, 4, 8, 16, 32, 64):
        yield count, bench_scenes.made("lattice", {**ONE_SAMPLE, "max_depth": count}, 5, 400, 300), {}


def pixels(*_):
    for side in (64, 128, 256, 512, 1024, 2048):
        yield side * side, bench_scenes.made("sphereflake", ONE_SAMPLE, 3, side, side), {}


def threads(*_):
    for count in range(1, os.cpu_count() + 1):
        yield count, bench_scenes.made("sphereflake", ONE_SAMPLE, 4, 512, 512), {"threads": count}


GROWING = {grow.__name__: grow for grow in (triangles, spheres, lights, depth, pixels, threads)}


def stages(run):
    """Milliseconds of parse, build and trace, and the rays, as the command line tells them."""
    figures = re.search(r"parse ([\d.]+) ms, build ([\d.]+) ms, trace ([\d.]+) ms", run.said)
    return *map(float, figures.groups()), int(programs.number(r"all +(\d+) rays", run.said))


def beside_bare(folder, rounds):
    """(nanoseconds a ray of bare Embree, times these our whole tracer takes, times its memory ours is)."""
    done = subprocess.run([programs.BIN / "rays_bench", folder / "scene.json", "400", "300", str(rounds)], check=True,
                          capture_output=True, text=True)
    whole = re.search(r"whole tracer +\d+ rays +([\d.]+) M/s.*Embree +([\d.]+)", done.stdout)
    rate, times = map(float, whole.groups())
    return 1000 / rate / times, times, programs.number(r"memory, .*ratio +([\d.]+)", done.stdout)


def print_growth(what, folder, most, rounds):
    in_trees = what in ("triangles", "spheres")
    print(f"\n{what:>10} {'parse/ms':>9} {'build/ms':>9} {'trace/ms':>9} {'rays':>10} {'a ray/ns':>9} {'x first':>8} "
          f"{'x log n':>8} {'peak MB':>8}" + (f" | {'bare: x first':>13} {'x time':>6} {'x memory':>8}" if in_trees else ""))
    first = first_bare = None
    for count, scene, options in GROWING[what](folder, most):
        program = programs.Whittle(scene, folder)
        runs = [program.run(**options) for _ in range(rounds)]
        parse, build, trace, rays = (min(column) for column in zip(*map(stages, runs)))
        ray_ns = 1e6 * trace / rays * options.get("threads", os.cpu_count())
        first = first or (ray_ns, count)
        log = f"{math.log(count) / math.log(first[1]):8.2f}" if in_trees else f"{'-':>8}"
        line = (f"{count:10} {parse:9.1f} {build:9.1f} {trace:9.1f} {rays:10.0f} {ray_ns:9.1f} {ray_ns / first[0]:8.2f} "
                f"{log} {max(run.memory_mb for run in runs):8.0f}")
        if in_trees:
            bare_ns, times, memory = beside_bare(folder, rounds)
            first_bare = first_bare or bare_ns
            line += f" | {bare_ns / first_bare:13.2f} {times:6.2f} {memory:8.2f}"
        print(line)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", default=list(GROWING), metavar="WHAT")
    parser.add_argument("--most", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    for what in arguments.what:
        if what not in GROWING:
            parser.error(f"{what} is none of {' '.join(GROWING)}")
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; the least of {arguments.rounds} rounds")
    with tempfile.TemporaryDirectory() as folder:
        for what in arguments.what:
            print_growth(what, pathlib.Path(folder), arguments.most, arguments.rounds)


if __name__ == "__main__":
    main()
