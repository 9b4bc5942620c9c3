#!/usr/bin/env -S /usr/bin/python3 -u
"""Time that Whittle, POV-Ray and Tachyon need for the same true error; for Whittle with a target error and with uniform samples.

    tests/bench/equal_error.py [SCENE ...] [--size 512x512] [--rounds 3] [--limit 20] [--avx2] [--points FILE]

SCENE is a scene of peers/bench_scenes.py or a file; by default the scenes of DEFAULT_SCENES below. A file is rendered by
Whittle alone, with the size and accuracy of this benchmark. Every program uses one thread per processor. Rays of Whittle
end by chance, those of POV-Ray and Tachyon after 10 bounces, and those of POV-Ray at a cutoff of 0.001, too. Each is
measured at a range of settings (peers/sweeps.py), POV-Ray with both methods of antialiasing, thresholds, depths, with and
without jitter, and with the faster of +BM1 and +BM2. Errors are distances to the limit of the same program. The table of a
target error interpolates between settings and extrapolates nothing: `never` means that Whittle does not reach it, `>3.0`
that no setting of the other does, though the dearest costs 3.0 times as much. The settings of POV-Ray and Tachyon end at
--limit times the cost of Whittle's most accurate image.

`cpu` is the CPU seconds of all threads minus those of an image of 16 x 12 pixels, `wall` the time likewise. Ratios are theirs
to those of Whittle with a target error; rays are compared with uniform samples only. --points writes all points as JSON.

--avx2 compiles build/avx2 with WHITTLE_ISA=avx2: Whittle for x86-64-v3 alone, without clones for other instruction sets, and
Embree with isa=avx2. POV-Ray and Tachyon are Debian's programs for any x86-64; POV-Ray selects code up to AVX2 for noise only.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench.peers import bench_scenes, document, equal_error, programs, sweeps  # pylint: disable=wrong-import-position
from tests.support.sources import SOURCE  # pylint: disable=wrong-import-position

EXAMPLES = ("cornell", "glass", "lens", "lights", "local_models", "shapes", "whitted")
DEFAULT_SCENES = (*(name for name in bench_scenes.SCENES if name != "molecule"),
                  *(SOURCE / "scenes" / f"{name}.json" for name in EXAMPLES))
PEERS = {"povray": (programs.PovRay, sweeps.POVRAY), "tachyon": (programs.Tachyon, sweeps.TACHYON)}
RIVALS = ("uniform", *PEERS)
TARGETS = (1, 2, 0.5)  # levels
REQUIRED_RAYS = {2: 2.2, 1: 2.7, 0.5: 3.5}  # geometric mean of the ratios to uniform samples
REQUIRED_RAYS_EACH = {1: 1.1}
REQUIRED_TIME = {1: 10}  # ratio to the peers, of each scene


def load(name, width, height):
    """(name, document) without accuracy"""
    if name in bench_scenes.SCENES:
        return name, bench_scenes.document(name, {}, None, width, height)
    path = pathlib.Path(name)
    return f"{path.stem}.json", {**json.loads(path.read_text()), "image": {"width": width, "height": height}}


class Row:
    """The points of all programs on a scene."""

    def __init__(self, name, scene, directory, binaries, options):
        self.name, self.missing, smallest = name, [], min(TARGETS)
        whittle, uniform = sweeps.whittle(scene, directory, binaries, options.rounds, options.reference ** 2 * 4)
        self.points = {"whittle": whittle.points(smallest), "uniform": uniform.points(smallest)}
        most = options.limit * max(point.cpu_s for point in self.points["whittle"])
        for other, (program, curves) in PEERS.items() if name in bench_scenes.SCENES else ():
            try:
                contender = sweeps.peer(program, curves, scene, directory / other, options.rounds, options.reference)
                self.points[other] = contender.points(smallest, most)
            except document.Unsupported as feature:
                self.missing.append(f"{other} does not support {feature}")

    def ours(self, target, field):
        return equal_error.cost_at(self.points["whittle"], target, field)

    def ratio(self, other, target, field):
        """None if the program lacks a feature of the scene, or if Whittle does not reach the target."""
        return equal_error.ratio_at(self.points[other], self.points["whittle"], target, field) if other in self.points else None

    def cells(self, target):
        ours = [self.ours(target, field) for field in ("cpu_s", "wall_s")]
        cells = [f"{self.name:17}", *(f"{cost.value:8.3f}" if cost else f"{'never':>8}" for cost in ours),
                 format_ratio(self.ratio("uniform", target, "rays"))]
        for other in RIVALS:
            cells += [format_ratio(self.ratio(other, target, field)) for field in ("cpu_s", "wall_s")]
        best = "povray" in self.points and equal_error.cost_at(self.points["povray"], target, "cpu_s")
        return " ".join(cells) + (f"  {best.setting}" if best else "")


def format_ratio(ratio):
    return f"{'-':>8}" if ratio is None else f"{'' if ratio.exact else '>'}{ratio.value:.2f}".rjust(8)


def heading(target):
    pair = f"{'cpu':>8} {'wall':>8}"
    print(f"\nTrue error of {target:g} level{'s' if target != 1 else ''}")
    print(f"{'':17} {'whittle':^17} {'uniform samples / whittle':^26} {'POV-Ray / whittle':^17} {'Tachyon / whittle':^17}")
    print(f"{'scene':17} {'cpu s':>8} {'wall s':>8} {'rays':>8} {pair} {pair} {pair}  POV-Ray's setting")


def table(rows, target):
    heading(target)
    for row in rows:
        print(row.cells(target))
    mean = lambda other, field: equal_error.geometric_mean([row.ratio(other, target, field) for row in rows])
    means = [mean("uniform", "rays")] + [mean(other, field) for other in RIVALS for field in ("cpu_s", "wall_s")]
    print(f"{'geometric mean':35} " + " ".join(f"{value:8.2f}" if value else f"{'-':>8}" for value in means))
    for line in below_bar(rows, target):
        print(f"below the bar: {line}")


def below_bar(rows, target):
    lines = [f"{row.name}: Whittle does not reach {target:g}" for row in rows if not row.ours(target, "cpu_s")]
    mean = equal_error.geometric_mean([row.ratio("uniform", target, "rays") for row in rows])
    if mean and mean < REQUIRED_RAYS[target]:
        lines.append(f"gain in rays {mean:.2f}, geometric mean, required {REQUIRED_RAYS[target]}")
    required = [("uniform", "rays", REQUIRED_RAYS_EACH.get(target, 0))]
    required += [(other, "cpu_s", REQUIRED_TIME.get(target, 0)) for other in PEERS]
    for other, field, least in required:
        ratios = {row.name: row.ratio(other, target, field) for row in rows}
        lines += [f"{name}: {other} {field} {ratio.value:.2f}, required {least}" for name, ratio in ratios.items()
                  if ratio and ratio.exact and ratio.value < least]
    return lines


def build_avx2():
    """The directory of programs for AVX2 alone."""
    directory = SOURCE / "build/avx2"
    for command in (["--preset", "release", "-B", directory, "-D", "WHITTLE_ISA=avx2"],
                    ["--build", directory, "--target", "whittle"]):
        subprocess.run(["cmake", *command], cwd=SOURCE, stdout=sys.stderr, check=True)
    return directory / "bin"


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", default=DEFAULT_SCENES)
    parser.add_argument("--size", default="512x512")
    parser.add_argument("--rounds", type=int, default=3, help="of settings that take less than 1 s")
    parser.add_argument("--reference", type=int, default=12, help="width of the larger references in image widths")
    parser.add_argument("--limit", type=float, default=20)
    parser.add_argument("--avx2", action="store_true")
    parser.add_argument("--points", type=pathlib.Path, metavar="FILE")
    return parser.parse_args()


def main():
    options = arguments()
    programs.require_programs("povray", "tachyon")
    binaries = build_avx2() if options.avx2 else programs.BIN
    width, height = map(int, options.size.split("x"))
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}; {width} x {height} pixels; Whittle and Embree: "
          + ("AVX2 alone" if options.avx2 else "the widest instruction set of the processor"))
    rows = []
    heading(TARGETS[0])
    with tempfile.TemporaryDirectory() as temporary:
        for argument in options.scenes:
            name, scene = load(argument, width, height)
            directory = pathlib.Path(temporary).resolve() / name
            directory.mkdir()
            rows.append(Row(name, scene, directory, binaries, options))
            print(rows[-1].cells(TARGETS[0]))
            if options.points:
                options.points.write_text(json.dumps({row.name: {program: [point._asdict() for point in points]
                                                                 for program, points in row.points.items()} for row in rows}))
    for target in TARGETS:
        table(rows, target)
    for row in rows:
        for reason in row.missing:
            print(f"{row.name}: {reason}")


if __name__ == "__main__":
    main()
