#!/usr/bin/env -S /usr/bin/python3 -u
"""The curve of example scenes from which the presets are points: for each target error what was claimed, what was true,
and what it took. Its second table is the README's.

    tests/bench/presets_table.py [SCENE ...] [--size 160x120] [--reference-samples 1024] [--keep FOLDER] [--readme]

`whittle measure` does the measuring; its files stay in FOLDER, from where the same command goes on. Figures are geometric
means over the scenes, seconds and samples relative to each scene's `standard`: how long that takes depends on the scene.
--readme puts the table into README.md.
"""
import argparse
import json
import math
import os
import pathlib
import re
import statistics
import subprocess
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("WHITTLE_BIN", SOURCE / "build/release/bin"))
SCENES = ("sphereflake", "whitted", "cornell", "glass", "lights", "textures", "shapes", "mountain")
BASE = "standard"
BEGIN, END = "<!-- presets: tests/bench/presets_table.py --readme -->\n\n", "\n<!-- end of presets -->\n"


def measured(scene, folder, arguments):
    """The points of a scene's curve, by target error."""
    subprocess.run([BIN / "whittle", "measure", SOURCE / f"scenes/{scene}.json", "--knobs", "target_error", "--size",
                    arguments.size, "--reference-samples", str(arguments.reference_samples), "-o", folder / scene,
                    "--quiet"], check=True, stdout=subprocess.DEVNULL)
    measurement = json.loads((folder / f"{scene}.json").read_text())
    print(f"{scene}: reference of {measurement['reference']['samples']} samples, good to "
          f"{measurement['reference']['error']:.3f} levels")
    return {point["settings"].get("target_error", point["value"]): point for point in measurement["points"]}


def mean(values):
    """Geometric; an error that the reference is too coarse to tell (0) is in no mean."""
    told = [value for value in values if value > 0]
    return math.exp(statistics.fmean(map(math.log, told))) if told else math.nan


def summed_up(curves):
    """A line for each target: (preset, target, claimed, true, worst true / claimed, samples, time / standard's)."""
    lines = []
    for target in sorted(curves[0], reverse=True):
        points = [curve[target] for curve in curves]
        bases = [next(point for point in curve.values() if point["preset"] == BASE) for curve in curves]
        lines.append((points[0]["preset"] or "", target, mean(point["claimed"]["estimate"] for point in points),
                      mean(point["error"] for point in points),
                      max(point["error"] / point["claimed"]["estimate"] for point in points),
                      mean(point["samples"]["mean"] for point in points),
                      mean(point["seconds"] / base["seconds"] for point, base in zip(points, bases))))
    return lines


def print_curve(lines):
    print(f"\n{'preset':10} {'target':>7} {'claimed':>8} {'true':>8} {'worst true/claimed':>18} {'samples':>8} {'time':>7}")
    for name, target, claimed, true, worst, samples, time in lines:
        print(f"{name:10} {target:7g} {claimed:8.3f} {true:8.3f} {worst:18.2f} {samples:8.1f} {time:7.2f}")


def table(lines, scenes, size):
    rows = [f"| preset | asked for | claimed | true | samples a pixel | time, of `{BASE}` |", 6 * "| --- " + "|"]
    rows += [f"| `{name}` | {target:g} | {claimed:.2f} | {true:.2f} | {samples:.1f} | {time:.2g} |"
             for name, target, claimed, true, _, samples, time in lines if name]
    return "\n".join(rows) + f"\n\nLevels; geometric means over {scenes} example scenes at {size} pixels.\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--size", default="160x120")
    parser.add_argument("--reference-samples", type=int, default=1024)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--readme", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as passing:
        folder = arguments.keep or pathlib.Path(passing)
        folder.mkdir(parents=True, exist_ok=True)
        lines = summed_up([measured(scene, folder, arguments) for scene in arguments.scenes])
    print_curve(lines)
    text = table(lines, len(arguments.scenes), arguments.size.replace("x", " x "))
    print("\n" + text)
    if arguments.readme:
        path = SOURCE / "README.md"
        path.write_text(re.sub(f"{BEGIN}.*?{END}", lambda _: BEGIN + text + END, path.read_text(), flags=re.DOTALL))


if __name__ == "__main__":
    main()
