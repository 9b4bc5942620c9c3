"""whittle measure: its rows are renders of documents, and the errors of models."""
import pathlib
import re
import tempfile
import unittest

import numpy

from tests.cli.measure_test import WithDirectory
from tests.support import images
from tests.support.whittle import whittle


class Rows(WithDirectory):
    """Each row is the image of the document with the named settings changed, as `whittle render` renders it."""

    GLASS = {"color": 0, "transmission": 0.9, "ior": 1.5}
    MATTE = {"color": [0.2, 0.5, 0.8]}

    @staticmethod
    def room(mirror, ball, **accuracy):
        """Mirrors that face each other, with a ball between them: of glass, which divides rays, or matte."""
        wall = {"color": 0.6, "diffuse": 0.02, "reflection": mirror}
        return {"version": 1, "image": {"width": 12, "height": 9}, "accuracy": accuracy,
                "camera": {"position": [0, 0, 0.9], "look_at": [0.3, 0.1, 0], "fov": 80},
                "lights": [{"type": "point", "position": [0.2, 1, 0.3], "intensity": 0.5}],
                "objects": [{"type": "box", "center": [0, 0, 0], "size": [3, 4, 3], "material": wall},
                            {"type": "sphere", "center": [0.3, 0, -0.4], "radius": 0.3,
                             "material": ball},
                            {"type": "disc", "center": [0, -1, 0], "normal": [0, 1, 0], "radius": 0.6,
                             "material": {"color": [0.7, 0.3, 0.2], "diffuse": 0.8}}]}

    def displayed(self, light):
        light = numpy.clip(light.astype(float), 0, 1)
        return 255 * numpy.where(light <= 0.0031308, 12.92 * light, 1.055 * numpy.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)

    def reference(self):
        """The mean image of the file with the sums of all images."""
        header, sums = pathlib.Path(f"{self.name}.reference").read_bytes().split(b"\n", 1)
        *_, width, height, _, count, complete = header.split()
        self.assertEqual(complete, b"1")
        shape = int(height), int(width), 3
        return numpy.frombuffer(sums, dtype=float)[:numpy.prod(shape)].reshape(shape) / int(count)

    def test_are_the_images_of_the_changed_documents(self):
        for mirror, ball, accuracy, parameter, rows in (
                (0.97, self.MATTE, {}, "target_error", {"8": {"target_error": 8}, "0.5": {"target_error": 0.5}}),
                (0.97, self.MATTE, {"samples": 4, "max_depth": 20}, "target_error", {"2": {"target_error": 2, "max_depth": 20}}),
                (0.9, self.MATTE, {"max_depth": 20, "seed": 3}, "samples", {"4": {"samples": 4, "max_depth": 20, "seed": 3}}),
                (0.9, self.MATTE, {"cutoff": 0.02}, "max_depth", {"4": {"samples": 16, "cutoff": 0.02, "max_depth": 4}}),
                (0.4, self.GLASS, {"preset": "fine", "cutoff": 0.01}, "approximate",
                 {"shadows: none": {"samples": 16, "cutoff": 0.01, "approximate": {"shadows": "none"}}})):
            document = self.room(mirror, ball, **accuracy)
            self.directory = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
            self.name = self.directory / "out"
            done = self.measure("--reference-samples", "64", "--threads", "2", "--quiet", "--parameters", parameter, document=document)
            self.assertEqual(done.returncode, 0, done.stderr)
            points = {point["value"]: point for point in self.result()["points"] if point["parameter"] == parameter}
            if parameter == "target_error" and not accuracy:
                self.assertTrue(all(point["claimed"]["met"] for point in points.values()), "the depth is that of documents")
            truth, own_error = self.displayed(self.reference()), self.result()["reference"]["error"]
            for value, changed in rows.items():
                with self.subTest(mirror=mirror, parameter=parameter, value=value):
                    done = whittle("render", "-", "-o", self.directory / "row.exr", document={**document, "accuracy": changed})
                    rays = {kind: int(count) for kind, count in re.findall(r"(?m)^(\w+) +(\d+) rays", done.stderr.decode())}
                    self.assertEqual({kind: rays[kind] for kind in points[value]["rays"]}, points[value]["rays"])
                    content = (self.directory / "row.exr").read_bytes()
                    whittle("render", "-", "-o", self.directory / "row.exr", document={**document, "accuracy": points[value]["settings"]})
                    self.assertEqual((self.directory / "row.exr").read_bytes(), content)
                    image = self.displayed(images.read_exr(content))
                    error = max(0, numpy.mean((image - truth) ** 2) - own_error ** 2) ** 0.5
                    self.assertAlmostEqual(max(error, own_error), points[value]["error"], delta=1e-3)


class Models(WithDirectory):
    """A ball on a plane under a sky: `--parameters model` compares the models of light."""

    PAINT = {"paint": {"model": "lambert", "color": [0.8, 0.6, 0.4]}}
    BALL = {"version": 1, "image": {"width": 12, "height": 9}, "accuracy": {"model": "global"}, "materials": PAINT,
            "camera": {"position": [0, 2, 6], "look_at": [0, 0.7, 0], "fov": 45}, "background": {"color": 0.3},
            "lights": [{"type": "point", "position": [4, 6, 5], "intensity": 0.4}],
            "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "paint"},
                        {"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": "paint"}]}
    ROW = re.compile(r"(?m)^[*! ] model ([a-z ]+): (.+?)" + 6 * r" +([\d.]+)" + "$")

    def test_table_has_the_seconds_and_the_errors_of_each_model(self):
        done = self.measure("--reference-samples", "1024", "--threads", "2", "--parameters", "model", document=self.BALL)
        self.assertEqual(done.returncode, 0, done.stderr)
        output, result = done.stdout.decode(), self.result()
        self.assertRegex(output, r"setting +seconds +error +claimed +samples +model +total\n")
        rows = [(*row[:2], *map(float, row[2:])) for row in self.ROW.findall(output.replace("<=", "  "))]
        models = ["whitted", "fitted ambient", "radiosity", "gather", "path"]
        self.assertEqual([row[:2] for row in rows],
                         [(model, value) for model in models for value in ("16 samples", "target 4", "target 1", "target 0.5")])
        for (model, _, seconds, error, claimed, samples, of_model, total), point in zip(rows, result["points"], strict=True):
            self.assertEqual(point["model"], model)
            for printed, value in ((seconds, point["seconds"]), (error, point["error"]), (samples, point["samples"]["mean"]),
                                   (claimed, point["claimed"]["estimate"]), (total, point["total_error"])):
                self.assertAlmostEqual(printed, value, delta=0.006)
            self.assertGreater(point["seconds"], 0)
            self.assertAlmostEqual(of_model, 0 if model == "path" else point["model_error"], delta=1e-4)
        by_model = {model: max(row[6] for row in rows if row[0] == model) for model in models}
        self.assertGreater(by_model["whitted"], 10 * by_model["fitted ambient"])
        self.assertGreater(by_model["fitted ambient"], 2 * max(by_model["radiosity"], by_model["gather"]))
        self.assertIn("- Whitted's image is ", output)
        self.assertRegex(output, r"come [\d.]+ % from interreflection of lights, [\d.]+ % from the background\n")


if __name__ == "__main__":
    unittest.main()
