#!/usr/bin/env -S /usr/bin/python3 -u
"""Time to an image of the rendering equation with a given error: Whittle by paths, by radiosity and by gathering, Blender's
Cycles, and POV-Ray with its radiosity.

    tests/bench/global_bench.py [PROGRAM ...] [--scene cornell_box] [--size 512x512] [--error 1] [--rounds 1]

The scene is one of scenes/ or of peers/interiors.py; all points reach down to the error. The error of every image is its distance to the rendering equation: the root of the
mean of (image - a)(image - b) for two independent images a and b by paths (peers/sweeps.py). Cycles solves the same
equation: the distance of its limit to theirs is printed, found from two independent images likewise. POV-Ray's radiosity has
a limit of its own, which is part of its error. Every program uses all processors. Seconds are those of the process without
those of an image of 16 x 12 pixels, which has no patches: these are part of the time. POV-Ray renders no interior.
PROGRAM is a word of the names in the table, such as `radiosity` or `cycles`; by default all of them run. Programs that are
not installed are left out.
"""
import argparse
import json
import math
import os
import pathlib
import shutil
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench.peers import equal_error, interiors, povray_radiosity, programs, sweeps  # pylint: disable=wrong-import-position
from tests.support.sources import SOURCE  # pylint: disable=wrong-import-position

TARGETS = (4, 2, 1)  # levels

COUNTS = (4, 16, 64, 256, 1024, 4096)
TARGET_ERRORS = (16, 8, 4, 2.8, 2, 1.4, 1)
GLOBAL = {"model": "global"}
EXACT = [[{**GLOBAL, "samples": [count, count]} for count in COUNTS],
         [{**GLOBAL, "target_error": target} for target in TARGET_ERRORS]]
BY_PATCHES = {by: [[{**GLOBAL, "target_error": target, "approximate": {"interreflection": by}} for target in TARGET_ERRORS]]
              for by in ("radiosity", "gather")}
CYCLES = [[{"samples": count, "threshold": 0} for count in COUNTS],
          [{"samples": 8192, "threshold": threshold} for threshold in (0.3, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005)]]


class Program(sweeps.Contender):
    """A program and its settings; prints each point that it measures."""

    def __init__(self, name, program, curves, idle_setting, scene, directory, references, rounds):
        places = [directory / name.replace(" ", "_"), directory / name.replace(" ", "_") / "few_pixels"]
        places[1].mkdir(parents=True)
        few = {**scene, "image": dict(zip(("width", "height"), sweeps.FEW_PIXELS))}
        self.name, self.reached = name, []
        super().__init__(curves, program(scene, places[0]).run, lambda: program(few, places[1]).run(idle_setting), references,
                         rounds)

    def measure(self, setting):
        point = super().measure(setting)
        print(f"{self.name:20} {point.wall_s:8.2f} {point.cpu_s:8.2f} {point.error:8.2f}  {point.setting}")
        return point


def independent_images(run, setting):
    """Two, as displayed."""
    return [sweeps.levels(run({**setting, "seed": seed})) for seed in (101, 102)]


def document(name, directory):
    """The document of an interior, whose sky is written into the directory; else that of scenes/."""
    if name not in interiors.INTERIORS:
        return json.loads((SOURCE / f"scenes/{name}.json").read_text())
    interiors.write_sky(directory / "sky.hdr")
    return {**interiors.INTERIORS[name](), "textures": {"sky": {"file": str(directory / "sky.hdr")}}}


def programs_to_run(words, scene, *arguments):
    known = [("whittle paths", programs.Whittle, EXACT, EXACT[0][0])]
    known += [(f"whittle {by}", programs.Whittle, curves, EXACT[0][0]) for by, curves in BY_PATCHES.items()]
    if shutil.which("blender"):
        known.append(("cycles", programs.Cycles, CYCLES, CYCLES[0][0]))
    if shutil.which("povray") and "background" not in scene:
        settings = povray_radiosity.SETTINGS
        known.append(("povray radiosity", programs.PovRayRadiosity, [[setting] for setting in settings], settings[0]))
    return [Program(*each, scene, *arguments) for each in known if not words or set(words) & set(each[0].split())]


def table(found):
    """Seconds of every program to each error."""
    print(f"\n{'wall seconds to':20} " + " ".join(f"{target:>7g} levels" for target in TARGETS))
    for program in found:
        costs = [equal_error.cost_at(program.reached, target, "wall_s") for target in TARGETS]
        print(f"{program.name:20} " + " ".join(f"{cost.value:14.2f}" if cost else f"{'never':>14}" for cost in costs))


def distance_of_limits(a, b):
    """Between the limits of two programs, in levels, from two independent images of each."""
    return math.sqrt(max(0.0, float(numpy.mean((a[0] - b[0]) * (a[1] - b[1])))))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="*", metavar="PROGRAM")
    parser.add_argument("--scene", default="cornell_box")
    parser.add_argument("--size", default="512x512")
    parser.add_argument("--error", type=float, default=min(TARGETS))
    parser.add_argument("--rounds", type=int, default=1)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; {options.scene}, {width} x {height} pixels")
    with tempfile.TemporaryDirectory() as temporary:
        directory = pathlib.Path(temporary).resolve()
        scene = {**document(options.scene, directory), "image": {"width": width, "height": height}}
        references = independent_images(programs.Whittle(scene, directory).run, {**GLOBAL, "samples": [512, 512]})
        found = programs_to_run(options.programs, scene, directory, references, options.rounds)
        for program in found:
            if program.name == "cycles":
                theirs = independent_images(program.run, {"samples": 512, "threshold": 0})
                print(f"distance between the limits of Cycles and Whittle: {distance_of_limits(theirs, references):.2f} levels")
        print(f"{'':20} {'wall s':>8} {'cpu s':>8} {'error':>8}  setting")
        for program in found:
            program.reached = program.points(options.error)
        table(found)


if __name__ == "__main__":
    main()
