#!/usr/bin/env -S /usr/bin/python3 -u
"""What features cost that are compiled in but not needed: instructions of tracing scenes that need few of them, by the
integrator that requirements pick and by the one that holds everything. Counted by valgrind, so the machine may be busy.

    tests/bench/model_instructions.py        (after a release build)
"""
import json
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from tests.bench.instructions import SOURCE, counts, written  # pylint: disable=wrong-import-position

SIDE = 96  # pixels
SCENES = ("sphereflake", "cornell", "local_models", "shading", "isometric")


def untextured(document):
    """The same with plain colours, so that the classic integrator can take it."""
    document.pop("textures", None)
    for material in [*document["materials"].values(), *(thing["material"] for thing in document["objects"])]:
        if isinstance(material, dict) and isinstance(material.get("color"), (str, dict)):
            material["color"] = 0.6
    document["accuracy"] = {**document.get("accuracy", {}), "samples": [1, 1]}
    return document


def main():
    print(f"{'scene':14} {'picked':8} {'instructions':>14} {'full model':>14} {'a pixel':>7} {'costs':>7}")
    with tempfile.TemporaryDirectory() as folder:
        paths = [written(untextured(json.loads((SOURCE / f"scenes/{name}.json").read_text())), folder, name, (SIDE, SIDE))
                 for name in SCENES]
        for name, picked, full in zip(SCENES, counts(paths), counts(paths, "full")):
            print(f"{name:14} {picked.model:8} {picked.instructions:14,} {full.instructions:14,} "
                  f"{picked.instructions / SIDE**2:7.0f} {full.instructions / picked.instructions - 1:+7.2%}")


if __name__ == "__main__":
    main()
