"""Growth of time and samples with the target error, over example scenes; the presets are points of this curve.

    tests/bench/growth_bench.py accuracy [SCENE ...] [--size 160x120] [--reference-samples 1024] [--keep DIRECTORY]
                                         [--write FILE]

`whittle measure` measures; its files stay in DIRECTORY, where the same command resumes. Figures are geometric means over
the scenes. Time is relative to the `standard` preset of each scene, because the scenes differ in cost. --write replaces
the table of presets in FILE, between the comments `<!-- presets ... -->` and `<!-- end of presets -->`.
"""
import argparse
import json
import math
import pathlib
import re
import statistics
import subprocess
import tempfile

from tests.support.whittle import BIN, SCENES

EXAMPLES = ("sphereflake", "whitted", "cornell", "glass", "lights", "textures", "shapes", "mountain")
BASE = "standard"
TABLE = re.compile(r"(<!-- presets[^\n]*-->\n\n).*?(\n<!-- end of presets -->\n)", re.DOTALL)


def measure(scene, directory, options):
    """{target error: point} of a scene's curve."""
    subprocess.run([BIN / "whittle", "measure", SCENES / f"{scene}.json", "--parameters", "target_error", "--size", options.size,
                    "--reference-samples", str(options.reference_samples), "-o", directory / scene, "--quiet"],
                   check=True, stdout=subprocess.DEVNULL)
    measurement = json.loads((directory / f"{scene}.json").read_text())
    print(f"{scene}: reference of {measurement['reference']['samples']} samples per pixel, error "
          f"{measurement['reference']['error']:.3f} levels")
    return {point["settings"].get("target_error", point["value"]): point for point in measurement["points"]}


def geometric_mean(values):
    """Without errors of 0, which are below the resolution of the reference."""
    positive = [value for value in values if value > 0]
    return math.exp(statistics.fmean(map(math.log, positive))) if positive else math.nan


def summarize(curves):
    """Per target: (preset, target, estimate, true error, samples, time relative to BASE)."""
    rows = []
    for target in sorted(curves[0], reverse=True):
        points = [curve[target] for curve in curves]
        bases = [next(point for point in curve.values() if point["preset"] == BASE) for curve in curves]
        rows.append((points[0]["preset"] or "", target, geometric_mean(point["claimed"]["estimate"] for point in points),
                     geometric_mean(point["error"] for point in points),
                     geometric_mean(point["samples"]["mean"] for point in points),
                     geometric_mean(point["seconds"] / base["seconds"] for point, base in zip(points, bases))))
    return rows


def table(rows, scenes, size):
    lines = [f"| preset | target error | estimated error | true error | samples per pixel | time relative to `{BASE}` |",
             6 * "| --- " + "|"]
    lines += [f"| `{name}` | {target:g} | {estimate:.2f} | {true:.2f} | {samples:.1f} | {time:.2g} |"
              for name, target, estimate, true, samples, time in rows if name]
    return "\n".join(lines) + f"\n\nErrors in levels; geometric means over {scenes} example scenes at {size} pixels.\n"


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=EXAMPLES, metavar="SCENE")
    parser.add_argument("--size", default="160x120")
    parser.add_argument("--reference-samples", type=int, default=1024)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--write", type=pathlib.Path, metavar="FILE")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as temporary:
        directory = options.keep or pathlib.Path(temporary)
        directory.mkdir(parents=True, exist_ok=True)
        rows = summarize([measure(scene, directory, options) for scene in options.scenes])
    text = table(rows, len(options.scenes), options.size.replace("x", " x "))
    print(text)
    if options.write:
        content, replaced = TABLE.subn(lambda found: found[1] + text + found[2], options.write.read_text())
        if not replaced:
            parser.error(f"{options.write} has no table of presets")
        options.write.write_text(content)
