#!/usr/bin/env -S /usr/bin/python3 -u
"""What features cost that are compiled in but not needed: instructions of tracing scenes that need few of them, by the
integrator that requirements pick and by the one that holds everything. Counted by valgrind, so the machine may be busy.

    tests/bench/model_instructions.py        (after a release build)
"""
import json
import os
import pathlib
import re
import subprocess
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("WHITTLE_BIN", SOURCE / "build/release/bin"))
SIDE = 96  # pixels: a minute or two for the whole table


def instructions(scene, model):
    """Of tracing alone, on one thread: the same number every time."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "--toggle-collect=tracer::render(*",
               BIN / "trace_model", scene, model]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return int(re.search(r"Collected : (\d+)", done.stderr)[1]), done.stdout.strip()


def untextured(document):
    """The same with plain colours, so that the classic integrator can take it."""
    document.pop("textures", None)
    for material in [*document["materials"].values(), *(thing["material"] for thing in document["objects"])]:
        if isinstance(material, dict) and isinstance(material.get("color"), (str, dict)):
            material["color"] = 0.6
    return document


def main():
    print(f"{'scene':14} {'picked':8} {'instructions':>14} {'full model':>14} {'a ray':>6} {'costs':>7}")
    with tempfile.TemporaryDirectory() as folder:
        for name in ("sphereflake", "cornell", "local_models", "shading", "isometric"):
            document = untextured(json.loads((SOURCE / f"scenes/{name}.json").read_text()))
            document["image"] = {"width": SIDE, "height": SIDE}
            document["accuracy"] = {**document.get("accuracy", {}), "samples": [1, 1]}
            path = pathlib.Path(folder) / f"{name}.json"
            path.write_text(json.dumps(document))
            picked, model = instructions(path, "picked")
            full, _ = instructions(path, "full")
            cost = full / picked - 1
            print(f"{name:14} {model:8} {picked:14,} {full:14,} {picked / SIDE**2:6.0f} {cost:+7.2%}")


if __name__ == "__main__":
    main()
