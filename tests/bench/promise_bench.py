#!/usr/bin/env -S /usr/bin/python3 -u
"""What POV-Ray's antialiasing promises, what is true of it, and what Whittle takes for the same true error, promised.

    tests/bench/promise_bench.py [SCENE[=SIZE] ...] [--picture 160x120] [--rounds 3] [--thresholds 0.3 0.1 0.03]

POV-Ray's +AM3 (3.8) promises that a share of the pixels, its confidence +AC, is within the threshold +A of the converged
picture. Where the program has no +AM3 (Debian's 3.7), +AM1 and +AM2 stand in its place, whose threshold says which
neighbours are so different that they are sampled more: the same promise is expected of them, at +AM3's confidence. A
pixel's difference is POV-Ray's: the sum over the channels, of codes from 0 to 1.
Whittle is asked, with target_error, for the root mean square error that POV-Ray turned out to have; its promise is kept
where the true error is at most what it claims. Then it is asked for as much more as it did better than that, so that the
true errors are equal: the last two columns. Each is held against a converged picture of its own program: POV-Ray's of
9 jittered samples in each of 8 x 8 parts of every pixel, ours of 1024 samples of another seed. Depth and cutoff are the
same and no matter. Times are of tracing, medians of rounds that run both.
"""
import argparse
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench.peers import bench_scenes, document, ppm, programs  # pylint: disable=wrong-import-position

CONFIDENCE = 0.95  # of +AM3 as of Whittle's claims
SCENES = ("sphereflake=3", "rings=2", "gears=3", "pot=64", "lattice=4", "glass=3")
PARTS = 8  # of a pixel's side in POV-Ray's converged picture


def has_am3(folder):
    """Asked of the program itself: without +AM3 it does not know +AC either."""
    said = subprocess.run(["povray", "+Inone.pov", "-D", "+A0.3", "+AM3", f"+AC{CONFIDENCE}"], cwd=folder, check=False,
                          capture_output=True, text=True).stderr
    return "parse command-line option" not in said


def methods(am3):
    return ((3, f"+AC{CONFIDENCE}"),) if am3 else ((1,), (2,))


def levels(picture):
    return [255 * ppm.encoded(sample) for sample in picture.samples]


class PovRay:
    """The scene in POV-Ray, with its converged picture."""

    def __init__(self, scene, folder):
        self.program = programs.PovRay(document.of(scene), folder)
        converged = self.program.run(sampling=("+A0.0", "+AM1", "+R3", "+J1"), scale=PARTS)
        self.truth = levels(ppm.shrunk(ppm.read(converged.picture), PARTS))

    def run(self, threshold, method):
        return self.program.run(sampling=(f"+A{threshold}", f"+AM{method[0]}", *method[1:]))

    def judged(self, run, threshold):
        """(root mean square error in levels, share of the pixels beyond the threshold)"""
        apart = [abs(a - b) for a, b in zip(levels(ppm.read(run.picture)), self.truth)]
        sums = [sum(apart[i:i + 3]) / 255 for i in range(0, len(apart), 3)]
        return (math.sqrt(statistics.fmean(value * value for value in apart)),
                statistics.fmean(difference > threshold for difference in sums))


class Whittle:
    """Likewise."""

    def __init__(self, scene, folder):
        self.scene, self.folder = scene, folder
        converged = programs.Whittle({**scene, "accuracy": {"samples": [1024, 1024], "seed": 1}}, folder).run()
        self.truth = converged.picture.rename(folder / "converged.tiff")

    def asked(self, target):
        return programs.Whittle({**self.scene, "accuracy": {"target_error": target}}, self.folder)

    def judged(self, run):
        """(claimed, true), levels"""
        return (programs.number(r"at most ([\d.]+) levels", run.said),
                programs.difference(self.truth, run.picture)["rmse"])


def milliseconds(runs):
    return 1000 * statistics.median(run.trace_s for run in runs)


def line(name, pov, ours, threshold, method, rounds):
    """Prints a line; gives (whether theirs was kept, whether ours was, ratio of times, ratio for equal true errors)."""
    theirs = [pov.run(threshold, method)]
    error, outside = pov.judged(theirs[0], threshold)
    own = [ours.asked(error).run()]
    claimed, true = ours.judged(own[0])
    equal = [ours.asked(error * error / max(true, 0.1 * error)).run()]
    for _ in range(rounds - 1):
        theirs.append(pov.run(threshold, method))
        own.append(ours.asked(error).run())
        equal.append(ours.asked(error * error / max(true, 0.1 * error)).run())
    their_ms, own_ms, equal_ms = map(milliseconds, (theirs, own, equal))
    kept, own_kept = outside <= 1 - CONFIDENCE, true <= claimed
    print(f"{name:12} +AM{method[0]} {threshold:5} {255 * threshold:7.1f} {100 * outside:8.2f}% {'yes' if kept else 'NO':>4} "
          f"{error:7.3f} {their_ms:8.0f}  {claimed:7.3f} {true:7.3f} {'yes' if own_kept else 'NO':>4} {own_ms:8.0f} "
          f"{their_ms / own_ms:7.2f}  {equal_ms:8.0f} {their_ms / equal_ms:7.2f}")
    return kept, own_kept, their_ms / own_ms, their_ms / equal_ms


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES, metavar="SCENE[=SIZE]")
    parser.add_argument("--picture", default="160x120")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--thresholds", type=float, nargs="+", default=[0.3, 0.1, 0.03])
    return parser.parse_args()


def main():
    wanted = arguments()
    programs.needed("povray")
    width, height = map(int, wanted.picture.split("x"))
    found = []
    with tempfile.TemporaryDirectory() as passing:
        folder = pathlib.Path(passing)
        am3 = has_am3(folder)
        print("this POV-Ray has +AM3" if am3 else "this POV-Ray has no +AM3 (it came with 3.8); +AM1 and +AM2 instead")
        print(f"{'':23} {'POV-Ray: levels, pixels beyond, kept, true, ms':^47}  {'Whittle: claimed, true, kept, ms':^39} "
              f"{'equal true error':>17}")
        print(f"{'scene':12} {'+A':>10} {'levels':>7} {'beyond':>9} {'kept':>4} {'true':>7} {'ms':>8}  {'claimed':>7} "
              f"{'true':>7} {'kept':>4} {'ms':>8} {'x time':>7}  {'ms':>8} {'x time':>7}")
        for asked in wanted.scenes:
            name, _, size = asked.partition("=")
            scene = bench_scenes.made(name, {}, int(size) if size else None, width, height)
            pov, ours = PovRay(scene, folder), Whittle(scene, folder)
            found += [line(name, pov, ours, threshold, method, wanted.rounds)
                      for method in methods(am3) for threshold in wanted.thresholds]
    kept, own_kept, ratios, equal_ratios = zip(*found)
    print(f"kept: POV-Ray {sum(kept)} of {len(found)}, Whittle {sum(own_kept)} of {len(found)}; POV-Ray takes "
          f"{statistics.geometric_mean(ratios):.2f} times as long to reach an error as Whittle to promise it, "
          f"{statistics.geometric_mean(equal_ratios):.2f} times as long as Whittle to reach it (geometric means)")


if __name__ == "__main__":
    main()
