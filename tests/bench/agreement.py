#!/usr/bin/env -S /usr/bin/python3 -u
"""Tests that the images of Whittle and Blender's Cycles have the same limit in every pixel.

    tests/bench/agreement.py [SCENE ...] [--size 128x128] [--samples 64] [--images 16] [--keep DIRECTORY]

Three of the scenes are those of Mitsuba's render tests (mitsuba-data, tests/scenes) without their texture files and without
their limit of one bounce: a sphere floating in the light of a direction, various shapes with a checker under a uniform sky, a
group of shapes placed three times in the light of a point. The others are mirrors over a checker and the Cornell box. Light of
lights is so weak that no pixel is above white. Both programs render all bounces; Cycles has triangles for curved shapes.

Of each program `--images` images with different seeds give the mean of a pixel and its variance. Student's t compares the means
of each pixel and channel. The criterion is that of Mitsuba's tests: a pixel disagrees if its t is so large that one of as many
pixels would be in 1 % of all cases, and at least 99.75 % must agree. Stricter are the shares of t beyond its 1 % and 5 % points,
the root mean square of t relative to its expected one, and the mean difference of the images with its standard error. Cycles
misses these at sharp edges: its samples are not quite uniform over a pixel. The edges of the floor under the floating sphere
cover 0.2492 and 0.2244 of their pixels; Whittle finds 0.2489 and 0.2240, Cycles 0.2450 and 0.2200. In the Cornell box Cycles is
0.2 % darker; there, another path tracer agrees with Whittle (tests/scenes/scenes_test.py).
The exit code is 1 if a scene misses the criterion.
"""
import argparse
import json
import math
import pathlib
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench.peers import ppm, programs, tessellate  # pylint: disable=wrong-import-position
from tests.support.images import read_tiff  # pylint: disable=wrong-import-position
from tests.support.sources import SOURCE  # pylint: disable=wrong-import-position

UP = [0, 0, 1]
CHECKER = {"checker": [0.8, 0.1], "scale": 10}
# Largest error of rounding to 16 bits, of the linear images of Cycles and the encoded ones of Whittle, whose steps are up to 2.3
# times as large.
ROUNDING = (1 + 2.3) / 2 / 65535
FOV = 39.3077  # Mitsuba's default, of a film of 36 x 24 mm and a lens of 50 mm


def rectangle(material, *steps):
    return {"type": "mesh", "positions": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "triangles": [[0, 1, 2], [0, 2, 3]],
            "uvs": [[0, 0], [1, 0], [1, 1], [0, 1]], "material": material, "transform": list(steps)}


def cube(material, *steps):
    return {"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1], "material": material, "transform": list(steps)}


def ball(material, radius, *steps):
    return {"type": "sphere", "center": [0, 0, 0], "radius": radius, "axis": UP, "material": material, "transform": list(steps)}


def lambert(color):
    return {"model": "lambert", "color": color}


def scale(*factors):
    return {"scale": list(factors)}


def move(*by):
    return {"translate": list(by)}


def turn(axis, angle):
    return {"rotate": {"axis": axis, "angle": angle}}


def floating_sphere():
    return {"camera": {"position": [0, -5, 1], "look_at": [0, 0, 0.5], "up": UP, "fov": FOV},
            "lights": [{"type": "directional", "direction": [0, 0, -1], "intensity": 0.95 / math.pi}],
            "materials": {"white": lambert(1)},
            "objects": [rectangle("white"), ball("white", 0.1, move(0, 0, 1))]}


def various_shapes():
    tilted = [turn([1, 0, 0], -35), turn([0, 1, 0], -25)]
    back = [turn([1, 0, 0], 35), turn([0, 1, 0], 25)]
    return {"camera": {"position": [-24, 0, 0], "look_at": [0, 0, 0], "up": UP, "fov": FOV},
            "background": {"color": [1, 1, 1]}, "materials": {"checks": lambert(CHECKER)},
            "objects": [
                ball("checks", 1.5, *tilted, move(0, -5, -2)),
                {"type": "cylinder", "from": [0, 0, 0], "to": UP, "radius": 1, "caps": False, "material": "checks",
                 "transform": [scale(1.5, 1.5, 2), *tilted, move(0, -2, -2)]},
                {"type": "disc", "center": [0, 0, 0], "normal": UP, "radius": 1, "material": "checks",
                 "transform": [scale(1.5, 2.5, 1), *tilted, move(0, 2.5, -2)]},
                rectangle("checks", scale(1.5, 2.5, 1), *tilted, move(0, 5, -2)),
                *(rectangle("checks", scale(-0.5, -0.5, -0.5), *back, move(0, y, 2)) for y in (1, 4, -2)),
                cube("checks", scale(1.5, 1.5, 0.2), move(0, 1, -5), turn([0, 1, 0], 25), turn(UP, 35)),
                cube("checks", move(0, 3, -5), turn([0, 1, 0], 25))]}


def instancing():
    coarse = tessellate.grid(lambda u, v: numpy.stack([
        numpy.sin(math.pi * v) * numpy.cos(2 * math.pi * u), numpy.sin(math.pi * v) * numpy.sin(2 * math.pi * u),
        -numpy.cos(math.pi * v)], 1), 32, 16)
    group = [{"type": "mesh", "positions": coarse[0].tolist(), "triangles": coarse[1].tolist(), "material": "green"},
             ball("orange", 0.5, move(-1, 0, 0)), rectangle("violet", scale(1.2, 1.2, 1.2), turn([0, 1, 0], -80))]
    place = lambda *steps: {"type": "instance", "of": "group", "transform": list(steps)}
    return {"camera": {"position": [-5, -6, 0], "look_at": [0, 0, 0], "up": UP, "fov": FOV},
            "lights": [{"type": "point", "position": [-5, -6, 0], "intensity": 80 / math.pi, "attenuation": "inverse_square"}],
            "materials": {"green": lambert([0.2, 0.5, 0.3]), "orange": lambert([0.9, 0.5, 0.3]), "violet": lambert([0.9, 0.5, 0.9])},
            "prototypes": {"group": group},
            "objects": [place(), place(turn([0, 1, 0], 45), scale(1.5, 1.5, 1.5), move(0, 0, 2)),
                        place(turn([0, 1, 0], -45), turn([1, 0, 0], -25), scale(1.5, 1.5, 1.5), move(0, 0, -2))]}


def mirrors():
    return {"camera": {"position": [-5, 0, 0], "look_at": [0, 0, 0], "up": UP, "fov": FOV},
            "background": {"color": [0.5, 0.7, 0.9]},
            "materials": {"mirror": {"model": "lambert", "diffuse": 0, "reflection": 0.9}, "checks": lambert(CHECKER)},
            "objects": [ball("mirror", 1, move(0, -1.05, -0.9)), ball("mirror", 1, move(0, 1.05, -0.9)),
                        ball("mirror", 1, move(0, 0, 0.9)), rectangle("checks", scale(4, 4, 4), move(0, 0, -1.9))]}


def cornell_box():
    scene = json.loads((SOURCE / "scenes/cornell_box.json").read_text())
    scene["materials"]["lamp"]["emission"] = [0.9, 0.6, 0.3]
    return scene


SCENES = {each.__name__: each for each in (floating_sphere, various_shapes, instancing, mirrors, cornell_box)}


def whittle(scene, directory, samples, seed):
    accuracy = {"model": "global", "samples": [samples, samples], "seed": seed, "cutoff": 0, "max_depth": 1000}
    run = programs.Whittle({**scene, "accuracy": accuracy}, directory).run()
    encoded = read_tiff(run.image.read_bytes())[:, :, :3] / 65535
    return numpy.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)  # IEC 61966-2-1


def beyond(freedom, points):
    """Probabilities that the absolute value of Student's t is above `points`."""
    scale_of = math.gamma((freedom + 1) / 2) / math.sqrt(freedom * math.pi) / math.gamma(freedom / 2)
    # Substituting t = sqrt(freedom) tan(a) leaves the integral of cos^(freedom - 1) over a bounded interval.
    angles = numpy.arctan(numpy.asarray(points, float) / math.sqrt(freedom))[..., None]
    nodes, weights = numpy.polynomial.legendre.leggauss(64)
    middle, half = (math.pi / 2 + angles) / 2, (math.pi / 2 - angles) / 2
    return 2 * scale_of * math.sqrt(freedom) * ((weights * numpy.cos(middle + half * nodes) ** (freedom - 1)).sum(-1) * half[..., 0])


def compare(ours, theirs):
    """The figures of two arrays (images, height, width, channels)."""
    count = len(ours)
    variance = (ours.var(0, ddof=1) + theirs.var(0, ddof=1)) / count
    variance += ROUNDING ** 2 / 12 / count  # not 0 where no light varies
    difference = ours.mean(0) - theirs.mean(0)
    t, freedom = difference / numpy.sqrt(variance), 2 * count - 2
    chance = beyond(freedom, abs(t))
    chance[abs(difference) <= ROUNDING] = 1  # pixels without noise differ by the rounding alone
    varies = ours.var(0) + theirs.var(0) > ROUNDING ** 2
    per_image = (ours - theirs).mean((1, 2, 3))
    return {"agree": float((chance > 1 - 0.99 ** (1 / chance.size)).mean()), "beyond 1 %": float((chance[varies] < 0.01).mean()),
            "beyond 5 %": float((chance[varies] < 0.05).mean()),
            "spread": float(numpy.sqrt((t[varies] ** 2).mean() / (freedom / (freedom - 2)))),
            "bias": 100 * float(per_image.mean() / theirs.mean()),
            "+-": 100 * float(per_image.std(ddof=1) / math.sqrt(count) / theirs.mean())}


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", choices=[[], *SCENES], help=", ".join(SCENES))
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--images", type=int, default=16)
    parser.add_argument("--keep", type=pathlib.Path, metavar="DIRECTORY", help="the mean images as PNG")
    return parser.parse_args()


def main():
    options = arguments()
    programs.require_programs("blender")
    width, height = map(int, options.size.split("x"))
    print(f"{'':16} {'agree':>9} {'beyond 1 %':>11} {'beyond 5 %':>11} {'spread':>7} {'bias in %':>16}")
    agree = True
    for name in options.scenes or SCENES:
        scene = {"version": 1, **SCENES[name](), "image": {"width": width, "height": height}}
        with tempfile.TemporaryDirectory() as temporary:
            directory, seeds = pathlib.Path(temporary), range(1, options.images + 1)
            ours = numpy.stack([whittle(scene, directory, options.samples, seed) for seed in seeds])
            cycles = programs.Cycles(tessellate.scene_of_meshes(scene), directory)
            theirs = numpy.stack([ppm.read(cycles.run({"samples": options.samples, "threshold": 0, "seed": seed}).image)
                                  for seed in seeds])
        if options.keep:
            options.keep.mkdir(parents=True, exist_ok=True)
            for program, images in (("whittle", ours), ("cycles", theirs)):
                ppm.write_png(images.mean(0), options.keep / f"{name}_{program}.png")
        found = compare(ours, theirs)
        agree = agree and found["agree"] >= 0.9975
        print(f"{name:16} {100 * found['agree']:7.3f} % {100 * found['beyond 1 %']:9.2f} % {100 * found['beyond 5 %']:9.2f} % "
              f"{found['spread']:7.3f} {found['bias']:8.3f} +- {found['+-']:.3f}")
    sys.exit(0 if agree else 1)


if __name__ == "__main__":
    main()
