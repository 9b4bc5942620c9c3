#!/usr/bin/env -S /usr/bin/python3 -u
"""The same pictures by Whittle, POV-Ray and Tachyon, side by side: time of tracing, time of the whole process, peak
memory, and how far the pictures are apart, which is the proof that the work was equal.

    tests/bench/peers_bench.py [SCENE[=SIZE] ...] [--picture 400x300] [--rounds 5] [--keep FOLDER]

Scenes and their sizes are those of peers/bench_scenes.py; all, at their usual sizes, when none is named. Documents end
at 64 MB: molecule=900000 and waves=600000 are the largest. One sample a pixel, five bounces, as many threads as
processors. Each round runs all programs, one after the other, and medians are told, so that a machine with other work
is unfair to all alike; `CPU of pixels` is what other work disturbs least: the CPU seconds of the whole process, all
threads, less those of the same with 16 x 12 pixels. POV-Ray is timed with +BM1 and with +BM2; the one that takes less
of that counts. `x bare` is how many times the seconds, one thread, of Embree and nothing else tracing exactly the same
rays: rays_bench records all that we trace.
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
Where pictures differ: POV-Ray and Tachyon leave a surface whose smooth normal faces away at its silhouette unlit
differently (pot, waves); Tachyon sees the background where the depth ends, the others nothing (sphereflake, lattice,
gears); numbers are 32-bit floats in Tachyon's files. What a program cannot be told is not approximated: it has no row.
Times: whittle's memory and process time hold its libraries loaded once a process; the daemon has them loaded. All three
write 16 bits a channel, not compressed."""


def median(runs, field):
    return statistics.median(getattr(run, field) for run in runs)


def geometric_mean(values):
    return math.exp(statistics.fmean(map(math.log, values))) if values else math.nan


def times_bare(scene, folder, rounds):
    """How many times as long as bare Embree on the same rays the whole tracer takes."""
    size = scene["image"].values()
    done = subprocess.run([programs.BIN / "rays_bench", folder / "scene.json", *map(str, size), str(rounds)], check=True,
                          capture_output=True, text=True)
    return float(re.search(r"whole tracer.*Embree +([\d.]+)", done.stdout)[1])


def contenders(scene, folder):
    """{name: program}, and why those that are not there are not."""
    found, missing = {"whittle": programs.Whittle(scene, folder)}, []
    for name, program, options in (("povray +BM1", programs.PovRay, {"bounding": 1}),
                                   ("povray +BM2", programs.PovRay, {"bounding": 2}), ("tachyon", programs.Tachyon, {})):
        got = programs.exported(program, scene, folder, **options)
        if isinstance(got, str):
            missing.append(f"{name} cannot have {got}")
        else:
            found[name] = got
    return found, missing


FIELDS = ("trace_s", "pixels_cpu_s", "whole_s", "memory_mb")


class Contender:
    """All that one program did with a scene: the picture, and one of next to no pixels."""

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
    """What one scene came to; ratios are theirs to ours, more than 1 where we are faster or smaller."""

    def __init__(self, name, scene, folder, rounds):
        few = folder / "few_pixels"
        few.mkdir(exist_ok=True)
        found, self.missing = contenders(scene, folder)
        idle, _ = contenders({**scene, "image": FEW_PIXELS}, few)
        all_of = {other: Contender(found[other], idle[other]) for other in found}
        for _ in range(rounds):
            for contender in all_of.values():
                contender.run()
        self.name, self.ours = name, all_of["whittle"]
        self.pov = min((other for other in all_of if other.startswith("povray")), default=None,
                       key=lambda other: all_of[other].median("pixels_cpu_s"))
        self.theirs = {"povray": all_of.get(self.pov), "tachyon": all_of.get("tachyon")}
        self.rmse = {other: difference(self.ours, one, folder / f"{other}_heat.png") for other, one in self.theirs.items()
                     if one}
        self.bare = times_bare(scene, folder, rounds)

    def ratio(self, other, field):
        """None where there is no such program, or where the picture took too little to tell."""
        one, ours = self.theirs[other], self.ours.median(field)
        return one.median(field) / ours if one and min(ours, one.median(field)) > 0 else None

    def cells(self):
        shown = [f"{self.name:12}", f"{1000 * self.ours.median('trace_s'):8.1f}"]
        for field in FIELDS:
            shown += [format_ratio(self.ratio(other, field)) for other in self.theirs]
        shown.append(format_ratio(self.bare))
        for other in self.theirs:
            found = self.rmse.get(other)
            shown.append(f"{found['rmse']:7.3f} {100 * found['differing']:5.2f}%" if found else f"{'-':>7} {'-':>6}")
        return " ".join(shown) + f"  {self.pov or ''}"


def difference(ours, theirs, heat):
    return programs.difference(ours.runs[0].picture, programs.shown(theirs.runs[0]), heat)


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
    parser.add_argument("--picture", default="400x300")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--keep", type=pathlib.Path, help="a folder for scenes, pictures and heat maps")
    return parser.parse_args()


def main():
    wanted = arguments()
    programs.needed("povray", "tachyon")
    width, height = map(int, wanted.picture.split("x"))
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; {width} x {height} pixels, medians of "
          f"{wanted.rounds} rounds; ratios are theirs / ours")
    heading()
    rows = []
    with tempfile.TemporaryDirectory() as passing:
        for asked in wanted.scenes or bench_scenes.SCENES:
            name, _, size = asked.partition("=")
            folder = (wanted.keep or pathlib.Path(passing)) / name
            folder.mkdir(parents=True, exist_ok=True)
            scene = bench_scenes.made(name, EQUAL_WORK, int(size) if size else None, width, height)
            rows.append(Row(name, scene, folder.resolve(), wanted.rounds))
            print(rows[-1].cells())
    sum_up(rows)


if __name__ == "__main__":
    main()
