"""Runs Whittle, POV-Ray, Tachyon and Cycles on a scene and reports time, memory and the image."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
from typing import NamedTuple

from tests.bench.peers import povray, povray_radiosity, tachyon
from tests.support.whittle import BIN


class Run(NamedTuple):
    trace_s: float      # tracing alone, as printed by the program
    whole_s: float      # from start to end of the process
    cpu_s: float        # of all threads of the process: the figure least affected by other work
    memory_mb: float    # peak resident memory
    image: pathlib.Path
    output: str         # standard output and error


class Failed(Exception):
    """The program failed; the text is the end of its output."""


def require_programs(*programs):
    """Exits with a message if one of them is not installed."""
    missing = [program for program in programs if not shutil.which(program)]
    if missing:
        sys.exit(f"{' and '.join(missing)} not found; docker/packages.txt does not list them, because only this comparison "
                 f"uses them: apt-get install {' '.join(missing)}")


def timed(command, directory):
    """((seconds, CPU seconds, resident MB), output). The output goes to a file, because a pipe could fill up.

    Starts with sync(2): a program that syncs its image, like Whittle, would else wait for the writes of the others."""
    os.sync()
    launch = [sys.executable, "-I", "-S", pathlib.Path(__file__).with_name("launch.py"), "usage.json"]
    with open(directory / "output", "w+b") as output:
        subprocess.run(list(map(str, launch + command)), cwd=directory, stdin=subprocess.DEVNULL, stdout=output,
                       stderr=subprocess.STDOUT, check=True)
        output.seek(0)
        text = output.read().decode(errors="replace")
    usage = json.loads((directory / "usage.json").read_text())
    if usage["status"] != 0:
        raise Failed(f"{command[0]} exited with {usage['status']}: {text[-600:]}")
    return (usage["seconds"], usage["cpu_seconds"], usage["memory_kb"] / 1024), text


def number(pattern, text):
    return float(re.search(pattern, text)[1])


class Whittle:
    def __init__(self, scene, directory, binaries=BIN):
        self.scene, self.directory, self.binaries = scene, directory, binaries

    def run(self, accuracy=None, threads=os.cpu_count()):
        """With the accuracy of the scene, or with another."""
        document = {**self.scene, "accuracy": accuracy or self.scene["accuracy"]}
        (self.directory / "scene.json").write_text(json.dumps(document, separators=(",", ":")))
        costs, text = timed([self.binaries / "whittle", "render", "scene.json", "-o", "whittle.tiff", "--threads", threads],
                            self.directory)
        return Run(number(r"trace ([\d.]+) ms", text) / 1000, *costs, self.directory / "whittle.tiff", text)


def run_povray(directory, size, options):
    costs, text = timed(["povray", "+Iscene.pov", "+Opovray.ppm", f"+W{size['width']}", f"+H{size['height']}", "-D", "-V", "+FP16",
                         "File_Gamma=1", f"+WT{os.cpu_count()}", *options], directory)
    return Run(number(r"Trace Time:.*\(([\d.]+) seconds\)", text), *costs, directory / "povray.ppm", text)


class PovRay:
    """`bounding` 1: slabs, its default; 2: a BSP tree."""

    def __init__(self, scene, directory, bounding=1):
        self.directory, self.bounding, self.size = directory, bounding, scene["image"]
        povray.write_scene(scene, directory / "scene.pov")

    def run(self, sampling="-A"):
        return run_povray(self.directory, self.size, [f"+BM{self.bounding}", *sampling.split()])


class PovRayRadiosity:
    def __init__(self, scene, directory):
        self.directory, self.size = directory, scene["image"]
        povray_radiosity.write_scene(scene, directory / "scene.pov")

    def run(self, setting):
        return run_povray(self.directory, self.size, povray_radiosity.options(setting))


class Tachyon:
    def __init__(self, scene, directory):
        self.directory = directory
        tachyon.write_scene(scene, directory / "scene.dat")

    def run(self, sampling=""):
        costs, text = timed(["tachyon", "scene.dat", "-format", "PPM48", "-o", "tachyon.ppm", "-numthreads", os.cpu_count(),
                             "-shade_phong", *sampling.split()], self.directory)
        return Run(number(r"Ray Tracing Time:\s+([\d.]+)", text), *costs, self.directory / "tachyon.ppm", text)


class Cycles:
    """Blender's Cycles with a scene of triangle meshes (cycles_scene.py); `setting` has the settings that differ."""

    def __init__(self, scene, directory):
        self.directory = directory
        (directory / "scene.json").write_text(json.dumps(scene))

    def run(self, setting):
        settings = {"seed": 1, "threads": os.cpu_count(), **setting}
        costs, text = timed(
            ["blender", "--background", "--factory-startup", "--python", pathlib.Path(__file__).with_name("cycles_scene.py"),
             "--", "scene.json", "cycles.ppm", json.dumps(settings)], self.directory)
        return Run(number(r"render ([\d.]+)", text), *costs, self.directory / "cycles.ppm", text)
