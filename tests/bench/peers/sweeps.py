"""Measures the settings of Whittle, POV-Ray and Tachyon on a scene: cost against true error (equal_error.py).

The error of an image is the distance to the limit of the same program, because programs differ slightly at silhouettes.
Each limit has two independent references, whose noise has a mean product of 0: the mean of (image - a)(image - b) over
pixels and channels is the squared error of the image alone. References of Whittle are images of uniform samples with
other seeds; those of the others are images of `factor` and `factor - 1` times the width and height, one ray per pixel.
"""
import math
import statistics

import numpy

from tests.bench.peers import ppm, programs
from tests.bench.peers.equal_error import Point
from tests.support.images import read_tiff

ONE_SAMPLE = {"samples": [1, 1]}  # rays of Whittle end by chance
MODEL = {"max_depth": 10, "cutoff": 0.001, **ONE_SAMPLE}  # of POV-Ray; Tachyon has no cutoff
FEW_PIXELS = 16, 12

TARGETS = [[{"target_error": target} for target in (16, 11, 8, 5.6, 4, 2.8, 2, 1.4, 1, 0.7, 0.5, 0.35, 0.25)]]
UNIFORM = [[{"samples": [side * side] * 2} for side in (1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32)]]
SIDES = {1: (2, 3, 4, 5, 6, 7, 9), 2: (1, 2, 3, 4, 5)}  # +R of method 1 is limited to 9
POVRAY = [["-A"]] + [[f"+AM{method} +A{threshold} +R{side} {jitter}" for side in SIDES[method]] for method, threshold, jitter in (
    (1, "0.0", "-J"), (2, "0.0", "-J"), (1, "0.03", "-J"), (1, "0.1", "-J"), (1, "0.03", "+J1.0"), (2, "0.003", "-J"),
    (2, "0.03", "-J"), (2, "0.0", "+J1.0"))]
TACHYON = [[f"-aasamples {2 ** n - 1}" for n in range(11)]]


def levels(run):
    """The image as displayed, in levels, before rounding to 8 bits."""
    if run.image.suffix == ".tiff":
        return read_tiff(run.image.read_bytes())[:, :, :3] * (255 / 65535)
    return 255 * ppm.encode_srgb(ppm.read(run.image))


def true_error(image, references):
    """In levels; 0 if it is below the resolution of the references."""
    a, b = references
    return float(numpy.sqrt(max(0.0, numpy.mean((image - a) * (image - b)))))


def sweep(curves, measure, smallest, most_cpu_s=math.inf):
    """The points of all curves, lists of settings with ascending cost. A curve ends with the first setting that reaches the
    error `smallest`, or costs more than one that does, or more than `most_cpu_s`."""
    points, cheapest = [], most_cpu_s
    for curve in curves:
        for setting in curve:
            point = measure(setting)
            points.append(point)
            if point.error <= smallest:
                cheapest = min(cheapest, point.cpu_s)
            if point.cpu_s >= cheapest:
                break
    return points


class Contender:
    """A program with a scene. `run(setting)` renders it, `idle` is the cost of an image of few pixels."""

    def __init__(self, curves, run, run_few_pixels, references, rounds):
        self.curves, self.run, self.references, self.rounds = curves, run, references, rounds
        runs = [run_few_pixels() for _ in range(5)]
        self.idle_cpu_s = statistics.median(run.cpu_s for run in runs)
        self.idle_wall_s = statistics.median(run.whole_s for run in runs)

    def measure(self, setting):
        """Short runs are repeated; their median counts."""
        runs = [self.run(setting)]
        while len(runs) < self.rounds and runs[0].cpu_s < 1:
            runs.append(self.run(setting))
        rays = programs.number(r"\nall +(\d+) rays", runs[0].output) if runs[0].image.suffix == ".tiff" else 0
        return Point(str(setting), true_error(levels(runs[0]), self.references),
                     statistics.median(run.cpu_s for run in runs) - self.idle_cpu_s,
                     statistics.median(run.whole_s for run in runs) - self.idle_wall_s, int(rays))

    def points(self, smallest, most_cpu_s=math.inf):
        return sweep(self.curves, self.measure, smallest, most_cpu_s)


def whittle(scene, directory, binaries, rounds, reference_samples):
    """The contenders with a target error and with uniform samples, which share their references."""
    few = directory / "few_pixels"
    few.mkdir()
    program = programs.Whittle(scene, directory, binaries)
    idle = programs.Whittle({**scene, "accuracy": ONE_SAMPLE, "image": dict(zip(("width", "height"), FEW_PIXELS))}, few, binaries)
    references = [levels(program.run({"samples": [reference_samples] * 2, "seed": seed})) for seed in (1, 2)]
    return [Contender(curves, program.run, idle.run, references, rounds) for curves in (TARGETS, UNIFORM)]


def peer(program, curves, scene, directory, rounds, factor):
    """The contender. POV-Ray has the faster of its bounding methods. Raises Unsupported."""
    def export(width, height, **options):
        place = directory / f"{width}x{height}"
        place.mkdir(parents=True, exist_ok=True)
        return program({**scene, "accuracy": MODEL, "image": {"width": width, "height": height}}, place, **options)

    def enlarged(times):
        image = export(times * width, times * height, **options).run().image
        mean = 255 * ppm.encode_srgb(ppm.read(image, times))
        image.unlink()  # it has hundreds of megabytes
        return mean

    (width, height), options = scene["image"].values(), {}
    if program is programs.PovRay:
        options = min(({"bounding": method} for method in (1, 2)),
                      key=lambda options: export(width, height, **options).run().cpu_s)
    exported = export(width, height, **options)
    references = [enlarged(times) for times in (factor - 1, factor)]
    return Contender(curves, exported.run, export(*FEW_PIXELS, **options).run, references, rounds)
