"""Runs Whittle, POV-Ray and Tachyon on a scene: what each took, and its picture as sRGB."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
from typing import NamedTuple

from tests.bench.peers import document, povray, ppm, tachyon

SOURCE = pathlib.Path(__file__).resolve().parents[3]
BIN = pathlib.Path(os.environ.get("WHITTLE_BIN", SOURCE / "build/release/bin"))


class Run(NamedTuple):
    trace_s: float      # tracing alone, as the program tells it
    whole_s: float      # from start to end of the process
    cpu_s: float        # of the whole process, all threads: what a busy machine disturbs least
    memory_mb: float    # the most that was resident
    picture: pathlib.Path
    said: str           # all that it printed


class Failed(Exception):
    """The program did not end well; the text is the end of what it printed."""


def needed(*programs):
    """Ends with a sentence where one of them is not installed."""
    missing = [program for program in programs if not shutil.which(program)]
    if missing:
        sys.exit(f"{' and '.join(missing)} not found; they are not among the packages of docker/packages.txt, for only "
                 f"these comparisons need them: apt-get install {' '.join(missing)}")


def timed(command, folder):
    """((seconds, CPU seconds, resident MB), output). Standard output and error are one file: no pipe can fill. All starts
    with nothing left to be written: a program that syncs its picture, as Whittle does, would wait for the others' too."""
    os.sync()
    launch = [sys.executable, "-I", "-S", pathlib.Path(__file__).with_name("launch.py"), "usage.json"]
    with open(folder / "said", "w+b") as said:
        subprocess.run(list(map(str, launch + command)), cwd=folder, stdin=subprocess.DEVNULL, stdout=said,
                       stderr=subprocess.STDOUT, check=True)
        said.seek(0)
        text = said.read().decode(errors="replace")
    usage = json.loads((folder / "usage.json").read_text())
    if usage["status"] != 0:
        raise Failed(f"{command[0]} ended with {usage['status']}: {text[-600:]}")
    return (usage["seconds"], usage["cpu_seconds"], usage["memory_kb"] / 1024), text


def number(pattern, text):
    return float(re.search(pattern, text)[1])


class Whittle:
    name = "whittle"

    def __init__(self, scene, folder):
        self.folder = folder
        (folder / "scene.json").write_text(json.dumps(scene, separators=(",", ":")))

    def run(self, threads=os.cpu_count()):
        costs, text = timed([BIN / "whittle", "render", "scene.json", "-o", "whittle.tiff", "--threads", threads],
                            self.folder)
        return Run(number(r"trace ([\d.]+) ms", text) / 1000, *costs, self.folder / "whittle.tiff", text)


class PovRay:
    """`bounding` 1: slabs, its default; 2: a tree that splits space. `sampling`: options of its own; none is one ray
    through the middle of each pixel."""
    name = "povray"

    def __init__(self, scene, folder, bounding=1):
        self.folder, self.bounding, self.size = folder, bounding, (scene.width, scene.height)
        povray.write_scene(scene, folder / "scene.pov")

    def run(self, threads=os.cpu_count(), sampling=("-A",), scale=1):
        width, height = (scale * side for side in self.size)
        costs, text = timed(["povray", "+Iscene.pov", "+Opovray.ppm", f"+W{width}", f"+H{height}", "-D", "-V", "+FP16",
                             "File_Gamma=1", f"+BM{self.bounding}", f"+WT{threads}", *sampling], self.folder)
        return Run(number(r"Trace Time:.*\(([\d.]+) seconds\)", text), *costs, self.folder / "povray.ppm", text)


class Tachyon:
    name = "tachyon"

    def __init__(self, scene, folder):
        self.folder, self.options = folder, (tachyon.highlights(scene),)
        tachyon.write_scene(scene, folder / "scene.dat")

    def run(self, threads=os.cpu_count()):
        costs, text = timed(["tachyon", "scene.dat", "-format", "PPM48", "-o", "tachyon.ppm", "-numthreads", threads,
                             *self.options], self.folder)
        return Run(number(r"Ray Tracing Time:\s+([\d.]+)", text), *costs, self.folder / "tachyon.ppm", text)


def exported(program, scene, folder, **options):
    """The program with the scene (a document), or the reason why it cannot have it, as text."""
    try:
        return program(document.of(scene), folder, **options)
    except document.Inexpressible as reason:
        return str(reason)


def shown(run):
    """The picture as a PNG of sRGB."""
    if run.picture.suffix != ".ppm":
        return run.picture
    png = run.picture.with_suffix(".png")
    ppm.write_png(ppm.read(run.picture), png)
    return png


def difference(a, b, heat=None):
    """What `whittle diff` says of two PNGs: rmse and the rest, in levels."""
    command = [BIN / "whittle", "diff", a, b, "--json"] + (["--heat", heat] if heat else [])
    return json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
