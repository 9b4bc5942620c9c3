#!/usr/bin/env -S /usr/bin/python3 -u
"""Compares Whittle, POV-Ray and Tachyon on the same scenes: tracing time, process time, peak memory, and the difference of
the images, which shows that the work was equal.

    tests/bench/peers_bench.py [SCENE[=SIZE] ...] [--size 400x300] [--rounds 5] [--keep DIRECTORY]

Scenes and their sizes are those of peers/bench_scenes.py; by default all of them at their default sizes. Documents are
limited to 64 MB: molecule=900000 and waves=600000 are the largest. One sample per pixel, five bounces, one thread per
processor. Each round runs all programs one after the other and the table shows medians, so that other work affects all
programs alike. `CPU of pixels` is the figure least affected by it: the CPU seconds of the process (all threads) minus
those of an image of 16 x 12 pixels. POV-Ray is timed with +BM1 and with +BM2; the faster one counts. `x bare` is our time
relative to Embree alone with the same rays on one thread (rays_bench).
"""
import argparse
import math
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench.peers import bench_scenes, programs  # pylint: disable=wrong-import-position

FEW_PIXELS = {"width": 16, "height": 12}
EQUAL_WORK = {"samples": [1, 1], "max_depth": 5, "cutoff": 0}  # Tachyon has no cutoff

NOTES = """\
Differences of the images: POV-Ray and Tachyon shade silhouettes whose smooth normal faces away differently (pot, waves);
at the maximum depth Tachyon returns the background, the others black (sphereflake, lattice, gears); Tachyon reads 32-bit
floats. An unsupported feature is not approximated: that program has no figures for the scene. The memory and process time
of whittle include loading its libraries, which the daemon does once. All programs write 16 bits per channel, uncompressed."""


def median(runs, field):
    return statistics.median(getattr(run, field) for run in runs)


def geometric_mean(values):
    return math.exp(statistics.fmean(map(math.log, values))) if values else math.nan


def relative_to_embree(scene, directory, rounds):
    """The time of the whole tracer relative to bare Embree with the same rays."""
    size = scene["image"].values()
    done = subprocess.run([programs.BIN / "rays_bench", directory / "scene.json", *map(str, size), str(rounds)], check=True,
                          capture_output=True, text=True)
    return float(re.search(r"whole tracer.*Embree +([\d.]+)", done.stdout)[1])


def programs_for(scene, directory):
    """({name: program}, the reason for each program that lacks a feature of the scene)"""
    found, missing = {"whittle": programs.Whittle(scene, directory)}, []
    for name, program, options in (("povray +BM1", programs.PovRay, {"bounding": 1}),
                                   ("povray +BM2", programs.PovRay, {"bounding": 2}), ("tachyon", programs.Tachyon, {})):
        exported = programs.export(program, scene, directory, **options)
        if isinstance(exported, str):
            missing.append(f"{name} does not support {exported}")
        else:
            found[name] = exported
    return found, missing


FIELDS = ("trace_s", "pixels_cpu_s", "whole_s", "memory_mb")


class Contender:
    """The runs of one program with a scene: the full image, and one of few pixels."""

    def __init__(self, program, program_of_few_pixels):
        self.program, self.few_pixels, self.runs, self.idle_runs = program, program_of_few_pixels, [], []

    def run(self):
        self.runs.append(self.program.run())
        self.idle_runs.append(self.few_pixels.run())

    def median(self, field):
        if field == "pixels_cpu_s":
            return median(self.runs, "cpu_s") - median(self.idle_runs, "cpu_s")
        return median(self.runs, field)


class Row:
    """The figures of one scene. Ratios are theirs / ours: above 1 where we are faster or smaller."""

    def __init__(self, name, scene, directory, rounds):
        few = directory / "few_pixels"
        few.mkdir(exist_ok=True)
        found, self.missing = programs_for(scene, directory)
        idle, _ = programs_for({**scene, "image": FEW_PIXELS}, few)
        all_of = {other: Contender(found[other], idle[other]) for other in found}
        for _ in range(rounds):
            for contender in all_of.values():
                contender.run()
        self.name, self.ours = name, all_of["whittle"]
        self.pov = min((other for other in all_of if other.startswith("povray")), default=None,
                       key=lambda other: all_of[other].median("pixels_cpu_s"))
        self.theirs = {"povray": all_of.get(self.pov), "tachyon": all_of.get("tachyon")}
        self.metrics = {other: difference(self.ours, peer, directory / f"{other}_heat.png")
                        for other, peer in self.theirs.items() if peer}
        self.bare = relative_to_embree(scene, directory, rounds)

    def ratio(self, other, field):
        """None if that program is missing, or if the time of the pixels is too short to measure."""
        peer, ours = self.theirs[other], self.ours.median(field)
        return peer.median(field) / ours if peer and min(ours, peer.median(field)) > 0 else None

    def cells(self):
        cells = [f"{self.name:12}", f"{1000 * self.ours.median('trace_s'):8.1f}"]
        for field in FIELDS:
            cells += [format_ratio(self.ratio(other, field)) for other in self.theirs]
        cells.append(format_ratio(self.bare))
        for other in self.theirs:
            found = self.metrics.get(other)
            cells.append(f"{found['rmse']:7.3f} {100 * found['differing']:5.2f}%" if found else f"{'-':>7} {'-':>6}")
        return " ".join(cells) + f"  {self.pov or ''}"


def difference(ours, theirs, heat):
    return programs.difference(ours.runs[0].image, programs.srgb_image(theirs.runs[0]), heat)


def format_ratio(ratio):
    return f"{ratio:8.2f}" if ratio else f"{'-':>8}"


def heading():
    pair = f"{'POV':>8} {'Tachyon':>8}"
    print(f"{'':12} {'trace':>8} {'x trace time':^17} {'x CPU of pixels':^17} {'x whole process':^17} "
          f"{'x peak memory':^17} {'x bare':>8} {'RMSE, > 1 level':^29}")
    print(f"{'scene':12} {'ours/ms':>8} {pair} {pair} {pair} {pair} {'Embree':>8} {'POV':^14} {'Tachyon':^14}")


def sum_up(rows):
    means = [geometric_mean([ratio for row in rows if (ratio := row.ratio(other, field))])
             for field in FIELDS for other in ("povray", "tachyon")]
    print(f"{'geom. mean':12} {'':8} " + " ".join(f"{mean:8.2f}" for mean in means)
          + f" {geometric_mean([row.bare for row in rows if row.bare]):8.2f}")
    for row in rows:
        for reason in row.missing:
            print(f"{row.name}: {reason}")
    print(NOTES)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE[=SIZE]")
    parser.add_argument("--size", default="400x300")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--keep", type=pathlib.Path, help="a directory for scenes, images and heat maps")
    return parser.parse_args()


def main():
    options = arguments()
    programs.require_programs("povray", "tachyon")
    width, height = map(int, options.size.split("x"))
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; {width} x {height} pixels, medians of "
          f"{options.rounds} rounds; ratios are theirs / ours")
    heading()
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        for argument in options.scenes or bench_scenes.SCENES:
            name, _, size = argument.partition("=")
            directory = (options.keep or pathlib.Path(temporary)) / name
            directory.mkdir(parents=True, exist_ok=True)
            scene = bench_scenes.document(name, EQUAL_WORK, int(size) if size else None, width, height)
            rows.append(Row(name, scene, directory.resolve(), options.rounds))
            print(rows[-1].cells())
    sum_up(rows)


if __name__ == "__main__":
    main()
