"""Exports to other ray tracers, costs at equal true error from measured points, and true errors. No other program is run."""
import pathlib
import tempfile
import unittest

import numpy

from tests.bench.peers import bench_scenes, document, povray, povray_radiosity, ppm, tachyon
from tests.bench.peers.equal_error import Point, Ratio, cost_at, frontier, geometric_mean, ratio_at
from tests.bench.peers.sweeps import MODEL, sweep, true_error
from tests.support.whittle import scene, whittle

SMALL = {"mountain": 6, "pot": 12, "molecule": 40, "waves": 40}


def bench_scene(name):
    return bench_scenes.document(name, MODEL, SMALL.get(name, 2), 8, 8)


def export(program, source):
    with tempfile.TemporaryDirectory() as directory:
        path = pathlib.Path(directory) / "scene"
        program.write_scene(source, path)
        return path.read_text()


class ExportedScene(unittest.TestCase):
    def test_has_the_camera_lights_and_materials(self):
        source = bench_scene("gears")
        source.update(camera={"position": [0, 0, 5], "look_at": [0, 0, 0], "fov": 90}, image={"width": 4, "height": 2})
        for program, parts in (
                (povray, ("location <0,0,5> direction <0,0,-1> right <4,0,0> up <0,2,0>", "light_source { <6,9,8> rgb <0.6,0.6,0.6> }",
                          "max_trace_level 11 adc_bailout 0.001 ", "phong 0.5 phong_size 60 reflection { rgb <0.15,0.15,0.15> }",
                          # divided by 1 - transmit, which POV-Ray multiplies them with
                          "transmit 0.75 } finish { diffuse 0.8 ", "ambient rgb <0.08,0.08,0.08>")),
                (tachyon, ("RESOLUTION 4 2", "RAYDEPTH 11 ", "FRUSTUM 2.5 -1.5 -1.5 0.5 ", "LIGHT CENTER 6 9 8 ", "COLOR 0.6 0.6 0.6",
                           "AMBIENT 0.02 DIFFUSE 0.2 SPECULAR 0.15 OPACITY 0.25 PHONG PLASTIC 0.5 PHONG_SIZE 60"))):
            text = export(program, source)
            for part in parts:
                self.assertIn(part, text)

    def test_has_every_object_of_a_valid_document(self):
        words = {"sphere": "SPHERE", "plane": "PLANE", "cylinder": "FCYLINDER"}
        for name in bench_scenes.SCENES:
            with self.subTest(name):
                content = bench_scene(name)
                self.assertEqual(whittle("check", "-", document=content).returncode, 0)
                self.assertEqual(export(povray, content).count(" material { m_"), len(content["objects"]))
                if name == "tree":
                    with self.assertRaisesRegex(document.Unsupported, "a cone"):
                        export(tachyon, content)
                    continue
                lines = export(tachyon, content).splitlines()
                for kind, word in words.items():
                    self.assertEqual(sum(line.startswith(word) for line in lines),
                                     sum(value["type"] == kind for value in content["objects"]))
                self.assertEqual(sum(line.startswith(("TRI", "STRI")) for line in lines),
                                 sum(len(value.get("triangles", ())) for value in content["objects"]))

    def test_has_the_radiance_of_a_glowing_rectangle_over_its_area_for_the_radiosity_of_pov_ray(self):
        # 130 x 105: L A / 2 pi = 18.387 * 13650 / 2 pi = 39945
        text = export(povray_radiosity, scene("cornell_box"))
        self.assertIn("light_source { <278,548.79,279.5> rgb <39945.", text)
        self.assertIn("point_at <278,547.79,279.5> area_light <0,0,105>, <-130,0,0>", text)
        self.assertEqual(text.count("no_radiosity no_shadow"), 1)
        self.assertEqual(text.count("mesh2"), len(scene("cornell_box")["objects"]))


def points(*pairs):
    """Points of (error, CPU seconds); the wall time is twice that."""
    return [Point(f"{error:g}", error, cpu_s, 2 * cpu_s) for error, cpu_s in pairs]


class CostAtEqualError(unittest.TestCase):
    ours = points((4, 1), (1, 2))

    def test_of_a_power_law_is_exact(self):
        law = points(*((error, 3 * error ** -1.5) for error in (9, 5, 1.7, 0.3)))
        for target in (8, 3, 1.7, 1, 0.4):
            self.assertAlmostEqual(cost_at(law, target, "cpu_s").value, 3 * target ** -1.5)
            self.assertAlmostEqual(cost_at(law, target, "wall_s").value, 6 * target ** -1.5)

    def test_is_of_points_that_no_other_beats(self):
        self.assertEqual(frontier(points((1, 5), (4, 1), (3, 6), (2, 2), (2, 3), (5, -1)), "cpu_s"), points((4, 1), (2, 2), (1, 5)))

    def test_is_not_extrapolated(self):
        self.assertIsNone(cost_at(points((4, 1), (2, 2)), 1.99, "cpu_s"))
        self.assertEqual(cost_at(points((4, 1), (2, 2)), 8, "cpu_s"), (1, "4"))
        self.assertEqual(cost_at(points((4, 1), (0, 2)), 1, "cpu_s"), (2, "0"))

    def test_is_compared_as_a_ratio_or_its_lower_bound(self):
        self.assertAlmostEqual(ratio_at(points((8, 1), (1, 20)), self.ours, 1, "cpu_s").value, 10)
        self.assertEqual(ratio_at(points((4, 1), (3, 6), (2, 5)), self.ours, 1, "cpu_s"), (3, False))
        self.assertIsNone(ratio_at(points((0.1, 1)), self.ours, 0.5, "cpu_s"))
        self.assertAlmostEqual(geometric_mean([Ratio(2, True), None, Ratio(8, True), Ratio(100, False)]), 4)


class Sweep(unittest.TestCase):
    def test_ends_a_curve_at_the_smallest_error_or_the_largest_cost(self):
        for curves, most, found in (
                ([[(3, 1), (0.9, 2), (0.5, 3)]], 9, [(3, 1), (0.9, 2)]), ([[(4, 1), (3, 5), (2, 6)]], 5, [(4, 1), (3, 5)]),
                ([[(1, 2)], [(3, 1), (2, 2), (1, 3)], [(4, 1), (0.9, 1.5)]], 9, [(1, 2), (3, 1), (2, 2), (4, 1), (0.9, 1.5)])):
            self.assertEqual(sweep(curves, lambda pair: points(pair)[0], 1, most), points(*found))


class TrueError(unittest.TestCase):
    def test_does_not_contain_the_noise_of_independent_references(self):
        random = numpy.random.default_rng(1)
        truth, image_noise, a, b = (random.normal(size=(200, 200, 3)) for _ in range(4))
        self.assertAlmostEqual(true_error(truth + 2 * image_noise, (truth + a, truth + b)), 2, delta=0.02)
        self.assertEqual(true_error(0 * truth, (truth, -truth)), 0)

    def test_is_of_an_enlarged_image_averaged_by_blocks_of_linear_values(self):
        codes = numpy.arange(4 * 6 * 3, dtype=">u2").reshape(4, 6, 3)
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "a.ppm"
            path.write_bytes(b"P6\n# by\n# someone\n6 4\n65535\n" + codes.tobytes())
            image = ppm.read(path, 2)
        self.assertEqual(image.shape, (2, 3, 3))
        self.assertAlmostEqual(image[1, 2, 1], codes[2:, 4:, 1].mean() / 65535)
        numpy.testing.assert_allclose(ppm.encode_srgb(numpy.array([0, 0.0031308, 0.2140411, 1])), [0, 0.04045, 0.5, 1], atol=1e-6)
