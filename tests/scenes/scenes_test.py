"""The example scenes: reproducible, valid, of limited size, and equal to their images in the gallery."""
import json
import re
import subprocess
import unittest

import numpy

from tests.support import images
from tests.support.whittle import QUICK, SCENES, DirectoryTest, scene, succeeded, whittle

NAMES = sorted(path.stem for path in SCENES.glob("*.json"))


class ExampleScenes(DirectoryTest):
    def test_equal_the_output_of_the_generator(self):
        subprocess.run(["/usr/bin/python3", SCENES / "generate.py", self.directory], check=True, timeout=600)
        written = {path.stem: path.read_bytes() for path in self.directory.glob("*.json")}
        assets = {path.name: path.read_bytes() for path in (self.directory / "assets").iterdir()}
        self.assertEqual(sorted(assets), sorted(path.name for path in SCENES.glob("assets/*")))
        for name, content in assets.items():
            self.assertTrue(content == (SCENES / "assets" / name).read_bytes(), f"assets/{name} differs")
        self.assertEqual(sorted(written), NAMES)
        for name in NAMES:
            self.assertTrue(written[name] == (SCENES / f"{name}.json").read_bytes(), f"{name}.json differs")

    def test_are_valid_and_have_a_target(self):
        for name in NAMES:
            self.assertIn("target_error", scene(name)["accuracy"], name)
            succeeded(whittle("check", SCENES / f"{name}.json"))

    def test_can_be_rendered_under_the_rendering_equation(self):
        (self.directory / "assets").symlink_to(SCENES / "assets")
        for name in NAMES:
            path = self.directory / f"{name}.json"
            path.write_text(json.dumps(scene(name, image={"width": 12, "height": 9},
                                             accuracy={"model": "global", "samples": 1})), encoding="utf-8")
            succeeded(whittle("render", path, "-o", self.directory / f"{name}.png"))


def of_half_the_size(image):
    """The mean light of 2 x 2 pixels each, as 8-bit codes of sRGB."""
    height, width = (side // 2 * 2 for side in image.shape[:2])
    codes = image[:height, :width] / 255
    light = numpy.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    light = light.reshape(height // 2, 2, width // 2, 2, -1).mean(axis=(1, 3))
    return 255 * numpy.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


# The samples of a pixel of the images in the gallery, where they are not 16.
SAMPLES = {"color_bleeding": 100, "cornell_box": 100, "daylight": 64, "lens": 100, "sphereflake": 4,
           **dict.fromkeys(("cube", "environment", "glass", "haze", "instances", "mesh_files", "mountain", "relief", "textures",
                            "whitted"), 9)}


def reference(name):
    """The scene with a fixed number of samples in place of its target."""
    document = scene(name)
    accuracy = {field: value for field, value in document["accuracy"].items() if field != "target_error"}
    return {**document, "accuracy": {**accuracy, "samples": SAMPLES.get(name, 16)}}


def pixels(path):
    return images.read_png(path.read_bytes()).astype(float)


class Gallery(DirectoryTest):
    def test_images_equal_renders_of_the_scenes(self):
        """With less effort they are like renders of a quarter of the pixels."""
        (self.directory / "assets").symlink_to(SCENES / "assets")
        for shown in sorted((SCENES / "images").glob("*.png")):
            document = reference(shown.stem)
            if QUICK:
                document["image"].update({side: document["image"][side] // 2 for side in ("width", "height")})
            (self.directory / "scene.json").write_text(json.dumps(document), encoding="utf-8")
            succeeded(whittle("render", self.directory / "scene.json", "-o", self.directory / shown.name))
            now, kept = pixels(self.directory / shown.name), pixels(shown)
            if QUICK:
                kept = of_half_the_size(kept)
                now = now[..., :kept.shape[2]]
            # Another processor or C library may round differently, so that single rays pass another side of an edge.
            self.assertLess(numpy.sqrt(numpy.mean((now - kept) ** 2)), 8.0 if QUICK else 1.0, f"{shown.name}: render it again")

    def test_has_an_image_of_at_most_300_kilobytes_of_every_scene_but_tiny(self):
        shown = {path.stem: path.stat().st_size for path in (SCENES / "images").glob("*.png")}
        self.assertEqual(sorted(shown), sorted(set(NAMES) - {"tiny"}))
        self.assertLessEqual(max(shown.values()), 300_000)


class GalleryOfModels(unittest.TestCase):
    """The table that scenes/models.py writes: the stated error of each model is the distance of the images."""

    def test_states_the_distance_of_each_image_from_that_of_paths(self):
        text = (SCENES / "README.md").read_text(encoding="utf-8")
        table = re.search(r"<!-- models: scenes/models.py -->(.*)<!-- end of models -->", text, re.DOTALL).group(1)
        models, _, _, errors = ([cell.strip() for cell in line.strip("|").split("|")]
                                for line in table.strip().splitlines())
        self.assertEqual(models, ["whitted", "fitted ambient", "radiosity", "gather", "path"])
        shown = {path.stem: pixels(path) for path in (SCENES / "images/models").glob("*.png")}
        self.assertEqual(set(shown), {model.replace(" ", "_") for model in models})
        distance = lambda model: numpy.sqrt(numpy.mean((shown[model.replace(" ", "_")] - shown["path"]) ** 2))
        noise = distance("gather")  # that of paths and of gather together
        for model, text in zip(models, errors):
            stated = float(re.search(r"[0-9.]+", text).group())
            error = max(0, distance(model) ** 2 - noise ** 2) ** 0.5
            tolerance = 0.05 * stated + 0.25 * noise
            self.assertLessEqual(error, stated + tolerance, model)
            if "at most" not in text:
                self.assertGreaterEqual(error, stated - tolerance, model)


@unittest.skipIf(QUICK, "its standard error takes a large image")
class CornellBox(DirectoryTest):
    def test_has_the_mean_radiance_that_another_path_tracer_finds(self):
        """One of 150 lines of its own, for this box: triangles one by one, light by points of the lamp alone. 39 million paths,
        standard error 0.02 %."""
        document = scene("cornell_box", accuracy={"model": "global", "samples": 32})
        succeeded(whittle("render", "-", "-o", self.directory / "box.exr", document=document))
        image = images.read_exr((self.directory / "box.exr").read_bytes())
        for mean, expected in zip(image.mean(axis=(0, 1)), (0.245428, 0.111930, 0.024662)):
            self.assertAlmostEqual(mean / expected, 1, delta=0.002)
