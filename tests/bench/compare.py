#!/usr/bin/env -S /usr/bin/python3 -u
"""Compares the tracer of two builds: rays per second, memory and CPU time, measured alternately in one run.

    tests/bench/compare.py --against OLD/bin [--bin NEW/bin] [--rounds 6] [--size 640x480] [SCENE ...]

Each round runs `rays_bench` (one thread, rays per second) and `whittle render` (all threads, adaptive sampling, CPU
seconds of the process) of both builds. The table shows the medians of both builds and the ratio new / old: the median of
the ratios of single rounds and their quartiles. Bare Embree is the same in both builds, so its ratio is the noise.
"""
import argparse
import collections
import os
import pathlib
import re
import resource
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.support.whittle import BIN, SCENES  # pylint: disable=wrong-import-position


def measure_alternately(measures, rounds):
    """Calls each function `rounds` times; for each of them {figure: [a value per round]}.

    The order is reversed in every second round, so that a drift of the machine's speed affects all alike.
    """
    found = [collections.defaultdict(list) for _ in measures]
    for number in range(rounds):
        for index in sorted(range(len(measures)), reverse=number % 2 == 1):
            for name, value in measures[index]().items():
                found[index][name].append(value)
    return found


def quartiles(values):
    """(first quartile, median, third quartile)"""
    ordered = sorted(values)
    return ordered[len(ordered) // 4], statistics.median(ordered), ordered[-1 - len(ordered) // 4]


def print_figures(found):
    """A line per figure: the median and quartiles of one build, or the medians of two builds and their ratio."""
    for name, values in found[0].items():
        low, median, high = quartiles(values)
        others = found[1].get(name) if len(found) > 1 else None
        if not others:
            print(f"{name:<52} {median:10.2f}   quartiles {low:.2f} to {high:.2f}", flush=True)
            continue
        low, ratio, high = quartiles([new / old if old else float("nan") for new, old in zip(values, others)])
        print(f"{name:<52} {median:10.2f} {statistics.median(others):10.2f}   ratio {ratio:6.3f}   quartiles {low:.3f} to "
              f"{high:.3f}", flush=True)


def child_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def tracer_figures(directory, scene, size):
    done = subprocess.run([directory / "rays_bench", scene, *size, "3"], check=True, capture_output=True, text=True)
    figures = {f"{scene.stem}: {name}, M rays/s": float(rate)
               for name, rate in re.findall(r"^(.*\S) +\d+ rays +([\d.]+) M/s", done.stdout, re.MULTILINE)}
    figures[f"{scene.stem}: memory of geometry and BVH, MB"] = float(re.search(r"([\d.]+) MB", done.stdout)[1])
    start = child_seconds()
    with tempfile.TemporaryDirectory() as output:
        subprocess.run([directory / "whittle", "render", scene, "-o", pathlib.Path(output) / "image.png", "--quiet"],
                       check=True)
    figures[f"{scene.stem}: whittle render, CPU s"] = child_seconds() - start
    return figures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default=BIN)
    parser.add_argument("--against", type=pathlib.Path, required=True)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--size", default="640x480")
    parser.add_argument("scenes", nargs="*", default=["sphereflake", "mountain", "whitted"], metavar="SCENE")
    options = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}, {options.rounds} rounds; new, old, new / old")
    for name in options.scenes:
        scene = SCENES / f"{name}.json"
        print_figures(measure_alternately(
            [lambda directory=directory, scene=scene: tracer_figures(directory, scene, options.size.split("x"))
             for directory in (options.bin, options.against)], options.rounds))


if __name__ == "__main__":
    main()
