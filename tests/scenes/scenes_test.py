"""The example scenes in scenes/: reproducible, within their bounds, accepted by the program."""
import pathlib
import subprocess
import tempfile
import unittest

import numpy

from tests.support import images
from tests.support.whittle import SCENES, scene, whittle

NAMES = sorted(path.stem for path in SCENES.glob("*.json"))


class ExampleScenes(unittest.TestCase):
    def test_are_what_the_generator_writes_byte_for_byte(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["/usr/bin/python3", SCENES / "generate.py", folder], check=True, timeout=600)
            written = {path.stem: path.read_bytes() for path in pathlib.Path(folder).glob("*.json")}
            assets = {path.name: path.read_bytes() for path in pathlib.Path(folder, "assets").iterdir()}
        self.assertEqual(sorted(assets), sorted(path.name for path in SCENES.glob("assets/*")))
        for name, content in assets.items():
            self.assertTrue(content == (SCENES / "assets" / name).read_bytes(), f"assets/{name} differs")
        self.assertEqual(sorted(written), NAMES)
        for name in NAMES:
            self.assertTrue(written[name] == (SCENES / f"{name}.json").read_bytes(), f"{name}.json differs")

    def test_are_accepted(self):
        for name in NAMES:
            done = whittle("check", SCENES / f"{name}.json")
            self.assertEqual(done.returncode, 0, f"{name}: {done.stdout.decode()}")

    def test_stay_below_eight_megabytes(self):
        for name in NAMES:
            self.assertLess((SCENES / f"{name}.json").stat().st_size, 8_000_000, name)

    def test_hold_what_the_documentation_says_of_them(self):
        kinds = [thing["type"] for thing in scene("sphereflake")["objects"]]
        self.assertEqual((len(kinds), kinds.count("sphere"), kinds.count("plane")), (7382, 7381, 1))
        triangles = sum(len(thing.get("triangles", [])) for thing in scene("mountain")["objects"])
        self.assertGreaterEqual(triangles, 100_000)
        self.assertEqual(scene("tiny")["image"], {"width": 16, "height": 16})
        models = [material["model"] for material in scene("local_models")["materials"].values()]
        self.assertLessEqual({"lambert", "phong", "blinn_phong"}, set(models))


class Gallery(unittest.TestCase):
    def test_shows_what_the_scenes_give(self):
        with tempfile.TemporaryDirectory() as folder:
            for shown in sorted((SCENES / "images").glob("*.png")):
                done = whittle("render", SCENES / f"{shown.stem}.json", "-o", f"{folder}/{shown.name}")
                self.assertEqual(done.returncode, 0, done.stderr)
                now = images.read_png((pathlib.Path(folder) / shown.name).read_bytes()).astype(float)
                kept = images.read_png(shown.read_bytes()).astype(float)
                # Another processor or C library may round another way, and tip single rays over an edge.
                self.assertLess(numpy.sqrt(numpy.mean((now - kept) ** 2)), 1.0, f"{shown.name}: draw it again")

    def test_shows_every_scene_but_the_tiny_one_in_at_most_300_kilobytes(self):
        shown = {path.stem: path.stat().st_size for path in (SCENES / "images").glob("*.png")}
        self.assertEqual(sorted(shown), sorted(set(NAMES) - {"tiny"}))
        self.assertLessEqual(max(shown.values()), 300_000)


class Sphereflake(unittest.TestCase):
    def test_blooms_nine_balls_of_a_third_touching_each_ball_of_the_upper_four_levels(self):
        balls = [(thing["center"], thing["radius"]) for thing in scene("sphereflake")["objects"][1:]]
        per_level = [sum(abs(radius - 0.5 / 3**level) < 1e-6 for _, radius in balls) for level in range(5)]
        self.assertEqual(per_level, [1, 9, 81, 729, 6561])
        root = balls[0][0]
        for center, _ in (ball for ball in balls if abs(ball[1] - 0.5 / 3) < 1e-6):
            distance = sum((a - b) ** 2 for a, b in zip(center, root)) ** 0.5
            self.assertAlmostEqual(distance, 0.5 + 0.5 / 3, places=5)


if __name__ == "__main__":
    unittest.main()
