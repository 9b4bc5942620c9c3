#!/usr/bin/env -S /usr/bin/python3 -u
"""Time to an image of the rendering equation with a given error: Whittle by paths, by radiosity and by gathering, Blender's
Cycles, and POV-Ray with its radiosity.

    tests/bench/global_bench.py [PROGRAM ...] [--size 512x512] [--rounds 1] [--points FILE]

The scene is scenes/cornell_box.json. The error of every image is its distance to the rendering equation: the root of the
mean of (image - a)(image - b) for two independent images a and b by paths (peers/sweeps.py). Cycles solves the same
equation: the distance of its limit to theirs is printed, found from two independent images likewise. POV-Ray's radiosity has
a limit of its own, which is part of its error. Every program uses all processors. Seconds are those of the process without
those of an image of 16 x 16 pixels, which has no patches: these are part of the time. `claim` is the error that Whittle
states in its report.
PROGRAM is a word of the names in the table, such as `radiosity` or `cycles`; by default all of them run. Programs that are
not installed are left out.
"""
import argparse
import json
import math
import os
import pathlib
import shutil
import statistics
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench.peers import equal_error, povray_radiosity, programs, sweeps  # pylint: disable=wrong-import-position
from tests.support.sources import SOURCE  # pylint: disable=wrong-import-position

SCENE = SOURCE / "scenes/cornell_box.json"
FEW_PIXELS = 16, 16
REFERENCES = [{"samples": [512, 512], "seed": seed} for seed in (101, 102)]
CYCLES_REFERENCES = [{"samples": 512, "threshold": 0, "seed": seed} for seed in (101, 102)]
TARGETS = (4, 2, 1)  # levels
THREADS = os.cpu_count()

TARGET_ERRORS = (16, 8, 4, 2.8, 2, 1.4, 1)
EXACT = [[{"samples": [count, count]} for count in (4, 16, 64, 256, 1024, 4096)],
         [{"target_error": target} for target in TARGET_ERRORS]]
BY_PATCHES = {by: [[{"target_error": target, "approximate": {"interreflection": by}} for target in TARGET_ERRORS]]
              for by in ("radiosity", "gather")}
CYCLES = [[{"samples": count, "threshold": 0} for count in (4, 16, 64, 256, 1024, 4096)],
          [{"samples": 8192, "threshold": threshold} for threshold in (0.3, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005)]]


class Whittle(programs.Whittle):
    def __init__(self, scene, directory):
        super().__init__(scene, directory)
        self.scene = scene

    def run(self, setting):
        document = {**self.scene, "accuracy": {"model": "global", **setting}}
        (self.directory / "scene.json").write_text(json.dumps(document))
        return super().run(THREADS)


class Radiosity:
    """POV-Ray with its radiosity."""

    def __init__(self, scene, directory):
        self.directory, self.size = directory, scene["image"]
        povray_radiosity.write_scene(scene, directory / "scene.pov")

    def run(self, setting):
        costs, text = programs.timed(
            ["povray", "+Iscene.pov", "+Opovray.ppm", f"+W{self.size['width']}", f"+H{self.size['height']}", "-D", "-V", "+FP16",
             "File_Gamma=1", f"+WT{THREADS}", *povray_radiosity.options(setting)], self.directory)
        return programs.Run(programs.number(r"Trace Time:.*\(([\d.]+) seconds\)", text), *costs, self.directory / "povray.ppm", text)


class Program:
    """A program, its settings, and the points it reached."""

    def __init__(self, name, program, curves, scene, directory, idle_setting=None):
        self.name, self.curves = name, curves
        places = [directory / name.replace(" ", "_"), directory / name.replace(" ", "_") / "few_pixels"]
        for place in places:
            place.mkdir(parents=True)
        few = {**scene, "image": dict(zip(("width", "height"), FEW_PIXELS))}
        self.program, self.few_pixels = program(scene, places[0]), program(few, places[1])
        idle = [self.few_pixels.run(idle_setting or curves[0][0]) for _ in range(3)]
        self.idle_cpu_s, self.idle_wall_s = (statistics.median(getattr(run, field) for run in idle)
                                             for field in ("cpu_s", "whole_s"))
        self.points = []

    def sweep(self, references, smallest, rounds):
        self.points = sweeps.sweep(self.curves, lambda setting: self.measure(setting, references, rounds), smallest)

    def measure(self, setting, references, rounds):
        runs = [self.program.run(setting) for _ in range(rounds)]
        point = equal_error.Point(json.dumps(setting), sweeps.true_error(sweeps.levels(runs[0]), references),
                                  statistics.median(run.cpu_s for run in runs) - self.idle_cpu_s,
                                  statistics.median(run.whole_s for run in runs) - self.idle_wall_s)
        claim = f"{programs.number(CLAIM, runs[0].output):7.2f}" if runs[0].image.suffix == ".tiff" else f"{'':7}"
        print(f"{self.name:20} {point.wall_s:8.2f} {point.cpu_s:8.2f} {point.error:8.2f} {claim}  {point.setting}")
        return point


CLAIM = r"error +(?:at most )?([\d.]+) levels"


def images_without_bias(program, settings):
    """Two independent images, as displayed."""
    return [sweeps.levels(program.run(setting)) for setting in settings]


def programs_to_run(words, scene, directory):
    known = [("whittle paths", Whittle, EXACT, None)]
    known += [(f"whittle {by}", Whittle, curves, EXACT[0][0]) for by, curves in BY_PATCHES.items()]
    if shutil.which("blender"):
        known.append(("cycles", programs.Cycles, CYCLES, None))
    if shutil.which("povray"):
        known.append(("povray radiosity", Radiosity, [[setting] for setting in povray_radiosity.SETTINGS], None))
    return [Program(name, program, curves, scene, directory, idle) for name, program, curves, idle in known
            if not words or set(words) & set(name.split())]


def table(found):
    """Seconds of every program to each error."""
    print(f"\n{'wall seconds to':20} " + " ".join(f"{target:>7g} levels" for target in TARGETS))
    for program in found:
        cells = []
        for target in TARGETS:
            cost = equal_error.cost_at(program.points, target, "wall_s")
            cells.append(f"{cost.value:14.2f}" if cost else f"{'never':>14}")
        print(f"{program.name:20} " + " ".join(cells))


def distance_of_limits(a, b):
    """Between the limits of two programs, in levels, from two independent images of each."""
    return math.sqrt(max(0.0, float(numpy.mean((a[0] - b[0]) * (a[1] - b[1])))))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="*", metavar="PROGRAM")
    parser.add_argument("--size", default="512x512")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--points", type=pathlib.Path, metavar="FILE", help="all points as JSON")
    return parser.parse_args()


def main():
    options = arguments()
    width, height = map(int, options.size.split("x"))
    scene = {**json.loads(SCENE.read_text()), "image": {"width": width, "height": height}}
    print(f"{THREADS} processors, load {os.getloadavg()[0]:.1f}; {SCENE.stem}, {width} x {height} pixels")
    with tempfile.TemporaryDirectory() as temporary:
        directory = pathlib.Path(temporary).resolve()
        found = programs_to_run(options.programs, scene, directory)
        references = images_without_bias(Whittle(scene, directory), REFERENCES)
        for program in found:
            if program.name == "cycles":
                theirs = images_without_bias(program.program, CYCLES_REFERENCES)
                print(f"distance between the limits of Cycles and Whittle: {distance_of_limits(theirs, references):.2f} levels")
        print(f"{'':20} {'wall s':>8} {'cpu s':>8} {'error':>8} {'claim':>7}  setting")
        for program in found:
            program.sweep(references, min(TARGETS), options.rounds)
        table(found)
        if options.points:
            options.points.write_text(json.dumps({program.name: [point._asdict() for point in program.points]
                                                  for program in found}))


if __name__ == "__main__":
    main()
