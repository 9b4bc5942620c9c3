"""The images of the scene format's page: valid scenes, small files, equal to a new render, and one for each type."""
import importlib.util
import re
import unittest

import numpy

from api import scene_schema
from tests.support import images
from tests.support.sources import SOURCE
from tests.support.whittle import BIN, succeeded, temporary_directory

DOCS = SOURCE / "api/docs"
PAGE = (SOURCE / "api/docs/scene.md").read_text(encoding="utf-8")


def script():
    spec = importlib.util.spec_from_file_location("render_images", DOCS / "render_images.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


RENDERING = script()
SCENES = RENDERING.scenes()


def types(definition):
    """The values of `type` of a definition of the schema."""
    schema = scene_schema.load()["$defs"]
    kinds = [schema[kind["$ref"].rsplit("/", 1)[1]] if "$ref" in kind else kind for kind in schema[definition]["oneOf"]]
    return {kind["properties"]["type"]["const"] for kind in kinds}


class Images(unittest.TestCase):
    def test_show_every_shape_and_light_and_the_recipes(self):
        of = lambda prefix: {name.removeprefix(prefix) for name in SCENES if name.startswith(prefix)}
        self.assertEqual(of("shape_"), types("object"))
        self.assertEqual(of("light_"), types("light"))
        self.assertEqual(of("recipe_"), {"a_glass_of_water", "a_lamp", "a_mirror", "fog", "a_label_on_a_bottle",
                                          "a_paper_screen", "a_stereo_pair"})
        self.assertGreaterEqual(len(of("material_")), 16)

    def test_are_all_on_the_page(self):
        self.assertEqual(sorted(re.findall(r"\(images/(\w+)\.png\)", PAGE)), sorted(SCENES))
        self.assertEqual(sorted(path.stem for path in (DOCS / "images").iterdir()), sorted(SCENES))

    def test_are_small(self):
        for path in (DOCS / "images").iterdir():
            self.assertLess(path.stat().st_size, 40_000, path.name)

    def test_are_renders_of_valid_scenes_without_warnings(self):
        directory = temporary_directory(self)
        for name, document in SCENES.items():
            done = succeeded(RENDERING.render(BIN / "whittle", name, document, directory))
            self.assertNotIn(b"warning", done.stderr, name)
            now = images.read_png((directory / f"{name}.png").read_bytes()).astype(float)
            kept = images.read_png((DOCS / "images" / f"{name}.png").read_bytes()).astype(float)
            self.assertEqual(now.shape, (120, 160, 3))
            # Another processor or C library may round differently, so that single rays pass another side of an edge.
            self.assertLess(numpy.sqrt(numpy.mean((now - kept) ** 2)), 1.0, f"{name}: run api/docs/render_images.py")
