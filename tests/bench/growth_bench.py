#!/usr/bin/env -S /usr/bin/python3 -u
"""Growth of time and memory with one parameter of the work at a time.

    tests/bench/growth_bench.py [PARAMETER ...] [--most 1000000] [--rounds 3]
    tests/bench/growth_bench.py accuracy [--write FILE]      (growth_accuracy.py)

PARAMETER is triangles, spheres, lights, depth, pixels, threads or radiosity (triangles again, which light each other); all of
them by default. --most bounds triangles (10000000 takes 2 GB and minutes) and spheres (the document limit is about a million).
Times are the minimum of the rounds, because other work on the machine only adds to them. Peak memory includes the libraries of the process. `ns/ray` is tracing
time times threads per ray and `x first` its ratio to the first line. `x log n` is the growth of log n: the cost of a tree
if neighbouring rays visit the same nodes and memory latency stays constant. For incoherent rays the lower bound is bare
Embree with the same rays on one thread (rays_bench): growth of its time per ray, then our time and our memory (BVH and
geometry) relative to it.
"""
import argparse
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench import growth_accuracy  # pylint: disable=wrong-import-position
from tests.bench.peers import bench_scenes, programs  # pylint: disable=wrong-import-position

ONE_SAMPLE = {"samples": [1, 1], "max_depth": 5, "cutoff": 0}


def powers(least, most):
    """least, 10 least, ... up to most"""
    return [least * 10**i for i in range(1 + math.floor(math.log10(most / least) + 1e-9))]


# Each parameter yields (value, document, options of programs.Whittle.run) in growing order.

def triangles(directory, most):
    for wanted in powers(1000, most):
        document = bench_scenes.document("waves", ONE_SAMPLE, 2, 400, 300)
        count = bench_scenes.write_waves(wanted, directory / "waves.ply")
        document["objects"][0] = {"type": "mesh", "file": "waves.ply", "material": "water"}
        yield count, document, {}


def radiosity(directory, most):
    for count, document, _ in triangles(directory, most):
        accuracy = {"model": "global", "samples": [4, 4], "approximate": {"interreflection": "radiosity"}}
        yield count, {**document, "accuracy": accuracy}, {}


def spheres(_, most):
    for count in powers(1000, min(most, 900_000)) + ([900_000] if most >= 900_000 else []):
        yield count, bench_scenes.document("molecule", ONE_SAMPLE, count, 400, 300), {}


def lights(*_):
    for count in powers(1, 1000):
        document = bench_scenes.document("rings", ONE_SAMPLE, 2, 200, 150)
        document["lights"] = [{"type": "point", "intensity": 1 / count,
                               "position": [9 * math.cos(2.4 * i), 9, 9 * math.sin(2.4 * i)]} for i in range(count)]
        yield count, document, {}


def depth(*_):
    for count in (0, 1, 2, 4, 8, 16, 32, 64):
        yield count, bench_scenes.document("lattice", {**ONE_SAMPLE, "max_depth": count}, 5, 400, 300), {}


def pixels(*_):
    for side in (64, 128, 256, 512, 1024, 2048):
        yield side * side, bench_scenes.document("sphereflake", ONE_SAMPLE, 3, side, side), {}


def threads(*_):
    for count in range(1, os.cpu_count() + 1):
        yield count, bench_scenes.document("sphereflake", ONE_SAMPLE, 4, 512, 512), {"threads": count}


PARAMETERS = {parameter.__name__: parameter for parameter in (triangles, spheres, lights, depth, pixels, threads, radiosity)}


def stages(run):
    """(parse, build and trace in milliseconds, number of rays) as printed by the command line."""
    figures = re.search(r"parse ([\d.]+) ms, build ([\d.]+) ms, trace ([\d.]+) ms", run.output)
    return *map(float, figures.groups()), int(programs.number(r"all +(\d+) rays", run.output))


def compared_with_embree(directory, rounds):
    """(nanoseconds per ray of bare Embree, our time relative to it, our memory relative to its)"""
    done = subprocess.run([programs.BIN / "rays_bench", directory / "scene.json", "400", "300", str(rounds)], check=True,
                          capture_output=True, text=True)
    whole = re.search(r"whole tracer +\d+ rays +([\d.]+) M/s.*Embree +([\d.]+)", done.stdout)
    rate, times = map(float, whole.groups())
    return 1000 / rate / times, times, programs.number(r"memory, .*ratio +([\d.]+)", done.stdout)


def print_growth(name, directory, most, rounds):
    in_trees = name in ("triangles", "spheres")
    print(f"\n{name:>10} {'parse/ms':>9} {'build/ms':>9} {'trace/ms':>9} {'rays':>10} {'ns/ray':>9} {'x first':>8} "
          f"{'x log n':>8} {'peak MB':>8}" + (f" | {'bare: x first':>13} {'x time':>6} {'x memory':>8}" if in_trees else ""))
    first = first_bare = None
    for count, scene, options in PARAMETERS[name](directory, most):
        program = programs.Whittle(scene, directory)
        runs = [program.run(**options) for _ in range(rounds)]
        parse, build, trace, rays = (min(column) for column in zip(*map(stages, runs)))
        ray_ns = 1e6 * trace / rays * options.get("threads", os.cpu_count())
        first = first or (ray_ns, count)
        log = f"{math.log(count) / math.log(first[1]):8.2f}" if in_trees else f"{'-':>8}"
        line = (f"{count:10} {parse:9.1f} {build:9.1f} {trace:9.1f} {rays:10.0f} {ray_ns:9.1f} {ray_ns / first[0]:8.2f} "
                f"{log} {max(run.memory_mb for run in runs):8.0f}")
        if in_trees:
            bare_ns, times, memory = compared_with_embree(directory, rounds)
            first_bare = first_bare or bare_ns
            line += f" | {bare_ns / first_bare:13.2f} {times:6.2f} {memory:8.2f}"
        print(line)


def main():
    if sys.argv[1:2] == ["accuracy"]:
        growth_accuracy.main(sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parameters", nargs="*", choices=[*PARAMETERS, []], metavar="PARAMETER")
    parser.add_argument("--most", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; the minimum of {options.rounds} rounds")
    with tempfile.TemporaryDirectory() as directory:
        for name in options.parameters or PARAMETERS:
            print_growth(name, pathlib.Path(directory), options.most, options.rounds)


if __name__ == "__main__":
    main()
