#!/usr/bin/env -S /usr/bin/python3 -u
"""Instructions per ray of small images: the cost of tracing on one thread, independent of the machine's load.

    tests/bench/instructions.py                    prints them beside instructions.json
    tests/bench/instructions.py --against OLD/bin  prints them beside those of another build
    tests/bench/instructions.py --write            writes instructions.json (the commit states the reason)

Valgrind counts, and the counts are reproducible: it emulates AVX2 but not AVX-512, which decides the code path of Embree,
of our kernels and of the C library. They belong to the compiler and libraries of Debian 12. instructions_test.py compares
them with the file.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile
from typing import NamedTuple

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.support.whittle import BIN, scene  # pylint: disable=wrong-import-position

BASELINE = pathlib.Path(__file__).with_suffix(".json")

# Example scenes, their accuracy, and the code that their images exercise.
IMAGES = {
    "sphereflake": ({"samples": [1, 1]}, "spheres, mirrors, three lights"),
    "cornell": ({"samples": [1, 1]}, "triangles, attenuation, a mirror and a glass sphere"),
    "glass": ({"samples": [1, 1]}, "refraction in meshes with smooth normals, checkers"),
    "transparency": ({"samples": [1, 1]}, "shadow rays through transparent panes"),
    "lights": ({"samples": [1, 1]}, "area lights and spots"),
    "shapes": ({"samples": [1, 1]}, "every shape"),
    "local_models": ({"target_error": 2}, "adaptive sampling and the error estimate"),
}
SIZE = {"width": 64, "height": 48}


class Count(NamedTuple):
    rays: int
    instructions: int   # of tracer::render alone


def count(path, directory):
    """A Count of a scene."""
    with tempfile.TemporaryDirectory() as output:
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=out", "--toggle-collect=tracer::render(*",
                   directory / "whittle", "render", path, "-o", "image.png", "--report", "-", "--threads", "1", "--quiet"]
        done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=output)
        instructions = re.search(r"^totals: (\d+)", pathlib.Path(output, "out").read_text(), re.MULTILINE)[1]
    return Count(sum(json.loads(done.stdout)["rays"].values()), int(instructions))


def measure(directory=BIN):
    """{image: {"rays", "instructions_per_ray"}}"""
    found = {}
    with tempfile.TemporaryDirectory() as scenes:
        for name, (accuracy, _) in IMAGES.items():
            path = pathlib.Path(scenes, f"{name}.json")
            path.write_text(json.dumps(scene(name, accuracy=accuracy, image=SIZE)))
            rays, instructions = count(path, directory)
            found[name] = {"rays": rays, "instructions_per_ray": round(instructions / rays, 1)}
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--against", type=pathlib.Path)
    choice.add_argument("--write", action="store_true")
    options = parser.parse_args()
    found = measure()
    if options.against:
        others = measure(options.against.resolve())
    else:
        others = json.loads(BASELINE.read_text()) if BASELINE.exists() else found
    print(f"{'image':14} {'rays':>8} {'other':>8} {'instructions/ray':>16} {'other':>8} {'ratio':>7}  exercises")
    for name, (_, exercises) in IMAGES.items():
        (rays, per_ray), (other_rays, other_per_ray) = found[name].values(), others.get(name, found[name]).values()
        print(f"{name:14} {rays:8} {other_rays:8} {per_ray:16.1f} {other_per_ray:8.1f} {per_ray / other_per_ray:7.4f}  "
              f"{exercises}")
    if options.write:
        BASELINE.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
