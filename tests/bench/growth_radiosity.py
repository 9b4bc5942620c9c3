"""Radiosity in large scenes: a million triangles, 100,000 emitters, 10,000 instances.

    tests/bench/growth_bench.py radiosity [--divide 1] [--cancels 20]

Renders each scene, then again, interrupted at times that divide that of the whole render equally. `cancel ms` is the time from
the interruption to the end of the process, which includes the release of its memory: its median and its maximum.
--divide makes the scenes smaller.
"""
import argparse
import json
import math
import pathlib
import signal
import statistics
import subprocess
import tempfile
import time

from tests.bench.peers import bench_scenes, programs

ACCURACY = {"model": "global", "samples": [4, 4], "approximate": {"interreflection": "radiosity"}}
LIT = {"lights": [{"type": "point", "position": [3, 8, 2], "intensity": 0.6}], "background": {"color": 0.3}}


def corner(**more):
    """A floor and two walls, to be filled."""
    walls = [([-6, -1.2, -6], [6, -1, 6]), ([-6.2, -1, -6], [-6, 4, 6]), ([-6, -1, -6.2], [6, 4, -6])]
    return {"version": 1, "image": {"width": 256, "height": 256}, "accuracy": ACCURACY,
            "camera": {"position": [9, 6, 9], "look_at": [0, 0, 0], "fov": 50},
            "materials": {"paint": {"color": [0.7, 0.6, 0.5], "diffuse": 1, "specular": 0},
                          "lamp": {"color": 0, "emission": [2, 1.5, 1]}},
            "objects": [{"type": "box", "min": low, "max": high, "material": "paint"} for low, high in walls], **more}


def spread(index):
    """A place above the floor: low discrepancy by powers of the plastic number."""
    along = [(0.5 + index * step) % 1 for step in (0.8191725, 0.6710436, 0.5497005)]
    return [12 * along[0] - 6, 4 * along[1] - 0.9, 12 * along[2] - 6]


def triangles(directory, divide):
    bench_scenes.write_waves(1_000_000 // divide, directory / "waves.ply")
    scene = corner(**LIT)
    scene["objects"].append({"type": "mesh", "file": "waves.ply", "material": "paint"})
    return scene


def emitters(_, divide):
    scene = corner()
    scene["objects"] += [{"type": "sphere", "center": spread(index), "radius": 0.02, "material": "lamp"}
                         for index in range(100_000 // divide)]
    return scene


def instances(_, divide):
    tree = [{"type": "cylinder", "from": [0, 0, 0], "to": [0, 0.6, 0], "radius": 0.12, "material": "paint"},
            {"type": "cone", "base": [0, 0.4, 0], "apex": [0, 1.6, 0], "radius": 0.45, "material": "paint"}]
    scene = corner(**LIT, prototypes={"tree": tree})
    for index in range(10_000 // divide):
        x, _, z = spread(index)
        scene["objects"].append({"type": "instance", "of": "tree", "transform": [{"scale": 0.12}, {"translate": [x, -1, z]}]})
    return scene


def cancel_ms(directory, after_s):
    """None if the render ended before."""
    command = [programs.BIN / "whittle", "render", "scene.json", "-o", "cancelled.png", "--quiet"]
    with subprocess.Popen(command, cwd=directory, stderr=subprocess.DEVNULL) as process:
        time.sleep(after_s)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        if process.wait() != 130:
            return None
        return 1000 * (time.monotonic() - begin)


def print_scene(fill, divide, cancels):
    with tempfile.TemporaryDirectory() as temporary:
        directory = pathlib.Path(temporary)
        program = programs.Whittle(fill(directory, divide), directory)
        run = program.run()
        rays, claim = (programs.number(pattern, run.output) for pattern in (r"all +(\d+) rays", r"error +(?:at most )?([\d.]+) levels"))
        times = [cancel_ms(directory, run.whole_s * (index + 0.5) / cancels) for index in range(cancels)]
        ended = [taken for taken in times if taken is not None]
        slowest = times.index(max(ended)) if ended else 0
        print(f"{fill.__name__:10} {run.whole_s:7.1f} {run.cpu_s:7.1f} {run.memory_mb:8.0f} {rays:10.0f} {claim:6.2f} "
              f"{len(ended):7} {statistics.median(ended):8.0f} {max(ended):8.0f}  at {(slowest + 0.5) / cancels:.0%}")


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--divide", type=int, default=1)
    parser.add_argument("--cancels", type=int, default=20)
    options = parser.parse_args(arguments)
    print(f"{'':10} {'wall s':>7} {'cpu s':>7} {'peak MB':>8} {'rays':>10} {'claim':>6} {'cancels':>7} {'cancel ms':>17}")
    for fill in (triangles, emitters, instances):
        print_scene(fill, options.divide, options.cancels)
