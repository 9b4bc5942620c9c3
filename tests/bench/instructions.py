#!/usr/bin/env -S /usr/bin/python3 -u
"""Instructions a ray of some small pictures: what tracing costs, on one thread, without a clock.

    tests/bench/instructions.py            counts them and prints them beside instructions.json
    tests/bench/instructions.py --write    counts them and writes that file (say why in the same commit)

Counted by valgrind, so the machine may be busy. The numbers are the same every time: valgrind is a processor of its own
with AVX2 and without AVX-512 wherever AVX2 is, which decides for Embree, for our kernels and for the C library alike. They
belong to Debian 12's compiler and libraries. instructions_test.py holds the code to the file.
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
from typing import NamedTuple

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("WHITTLE_BIN", SOURCE / "build/release/bin"))
KEPT = pathlib.Path(__file__).with_suffix(".json")

# Example scenes, what they ask of accuracy, and what their pictures exercise.
PICTURES = {
    "sphereflake": ({"samples": [1, 1], "max_depth": 5}, "balls, mirrors, three lights"),
    "cornell": ({"samples": [1, 1]}, "triangles, attenuation, a mirror and a glass ball"),
    "glass": ({"samples": [1, 1]}, "refraction in meshes with smooth normals, checkers"),
    "transparency": ({"samples": [1, 1]}, "shadows through panes"),
    "lights": ({"samples": [1, 1]}, "soft lights and spots"),
    "shapes": ({"samples": [1, 1]}, "every shape"),
    "local_models": ({"target_error": 2}, "adaptive samples and the account of the error"),
}
WIDTH, HEIGHT = 64, 48


class Count(NamedTuple):
    model: str          # which integrator was picked
    rays: int
    instructions: int   # of tracer::render alone


def counts(paths, model="picked"):
    """A Count for each scene. All in one process: starting it takes valgrind longer than the pictures."""
    with tempfile.TemporaryDirectory() as folder:
        # Collected while in render; put down where the next scene begins, and at the end.
        command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=out", "--toggle-collect=tracer::render(*",
                   "--dump-before=tracer::compile(*", BIN / "trace_model", model, *paths]
        done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=folder)
        dumps = sorted(pathlib.Path(folder).glob("out.*"), key=lambda path: int(path.suffix[1:]))
        found = [int(re.search(r"^totals: (\d+)", path.read_text(), re.MULTILINE)[1])
                 for path in [*dumps[1:], pathlib.Path(folder) / "out"]]
    said = [line.split() for line in done.stdout.splitlines()]
    if not len(paths) == len(found) == len(said):
        raise RuntimeError(f"{len(paths)} scenes, {len(said)} pictures, {len(found)} counts")
    return [Count(name, int(rays), number) for (name, rays), number in zip(said, found)]


def written(document, folder, name, side):
    path = pathlib.Path(folder) / f"{name}.json"
    path.write_text(json.dumps({**document, "image": {"width": side[0], "height": side[1]}}))
    return path


def measured():
    """{picture: {"rays", "instructions_per_ray"}}"""
    with tempfile.TemporaryDirectory() as folder:
        paths = [written({**json.loads((SOURCE / f"scenes/{name}.json").read_text()), "accuracy": accuracy}, folder, name,
                         (WIDTH, HEIGHT)) for name, (accuracy, _) in PICTURES.items()]
        return {name: {"rays": count.rays, "instructions_per_ray": round(count.instructions / count.rays, 1)}
                for name, count in zip(PICTURES, counts(paths))}


def main():
    found = measured()
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    print(f"{'picture':14} {'rays':>8} {'kept':>8} {'instructions a ray':>18} {'kept':>8} {'change':>8}  exercises")
    for name, (_, exercises) in PICTURES.items():
        now, before = found[name], kept.get(name, found[name])
        change = now["instructions_per_ray"] / before["instructions_per_ray"] - 1
        print(f"{name:14} {now['rays']:8} {before['rays']:8} {now['instructions_per_ray']:18.1f} "
              f"{before['instructions_per_ray']:8.1f} {change:+8.2%}  {exercises}")
    if sys.argv[1:] == ["--write"]:
        KEPT.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
