"""whittle measure: files, table, and resumption after an interruption."""
import csv
import json
import os
import pathlib
import re
import signal
import subprocess
import time
import unittest
import xml.etree.ElementTree

from tests.support import images
from tests.support.whittle import BIN, SCENES, DirectoryTest, on_terminal, scene, succeeded, temporary_directory, whittle

TINY = ("--size", "32x24", "--reference-samples", "1024", "--threads", "2")


class Files(DirectoryTest):
    def setUp(self):
        super().setUp()
        self.name = self.directory / "out"

    def measure(self, *options, document=None, path="-"):
        return whittle("measure", path, "-o", self.name, *options, document=document)

    def result(self):
        return json.loads(pathlib.Path(f"{self.name}.json").read_text(encoding="utf-8"))


class Measure(unittest.TestCase):
    """One measurement of a reflecting scene, whose files the tests read."""

    @classmethod
    def setUpClass(cls):
        cls.directory = temporary_directory(cls)
        cls.done = succeeded(whittle("measure", "-", "-o", cls.directory / "out", *TINY, document=scene("tiny")))
        cls.result = json.loads((cls.directory / "out.json").read_text(encoding="utf-8"))

    def test_writes_png_svg_csv_and_json(self):
        self.assertEqual(sorted(path.name for path in self.directory.iterdir()),
                         ["out.csv", "out.json", "out.png", "out.reference", "out.svg"])
        self.assertEqual(images.read_png((self.directory / "out.png").read_bytes()).shape, (760, 1200, 3))
        drawing = "".join(xml.etree.ElementTree.parse(self.directory / "out.svg").getroot().itertext())
        for words in ("target_error", "claimed", "Pareto front", "For 4 levels: "):
            self.assertIn(words, drawing)

    def test_csv_json_and_standard_output_have_the_same_values(self):
        with open(self.directory / "out.csv", encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), len(self.result["points"]))
        output = self.done.stdout.decode()
        for index, (row, point) in enumerate(zip(rows, self.result["points"])):
            self.assertEqual((row["parameter"], row["value"]), (point["parameter"], point["value"]))
            for column, value in (("seconds", point["seconds"]), ("error", point["error"]),
                                  ("claimed", point["claimed"]["estimate"]),
                                  ("worst_tile", point["claimed"]["worst_tile"]),
                                  ("tone", point["claimed"]["parts"]["tone"])):
                self.assertAlmostEqual(float(row[column]), value, delta=1e-8 * abs(value))
            proven = point["claimed"]["proven"]
            self.assertEqual(row["proven"], "" if proven is None else f"{proven:.9g}")
            self.assertEqual(int(row["camera"]), point["rays"]["camera"])
            self.assertEqual(row["pareto_front"] == "1", index in self.result["pareto_front"])
            self.assertEqual((row["broken"] == "1", int(row["runs"])), (point["broken"], len(point["runs"])))
            self.assertEqual(row["upper_limits"].split(), point["upper_limits"])
            is_limit = point["error"] <= self.result["reference"]["error"]
            self.assertEqual(point["upper_limits"], ["error"] if is_limit else [])
            mark = "!" if point["broken"] else "*" if index in self.result["pareto_front"] else " "
            sign = "<=" if is_limit else ""
            self.assertRegex(output, rf"(?m)^{re.escape(mark)} {point['parameter']} {re.escape(point['value'])}.* {sign} ?{point['error']:.4f} ")
        for sentence in self.result["advice"]:
            self.assertIn(f"- {sentence}\n", output)


class Resume(Files):
    PARAMETERS = ("--parameters", "samples,target_error")

    def assert_kept(self, before, after):
        """`after` has the points of `before`, perhaps with further runs."""
        for old, new in zip(before, after, strict=True):
            self.assertEqual(new["runs"][:len(old["runs"])], old["runs"], "measured again")
            self.assertEqual((new["parameter"], new["value"], new["error"], new["rays"]),
                             (old["parameter"], old["value"], old["error"], old["rays"]))

    def test_measures_each_setting_once(self):
        self.assertEqual(self.measure(*TINY, "--parameters", "samples", document=scene("tiny")).returncode, 0)
        before = self.result()["points"]
        self.assertEqual(self.measure(*TINY, *self.PARAMETERS, document=scene("tiny")).returncode, 0)
        self.assert_kept(before, [point for point in self.result()["points"] if point["parameter"] == "samples"])
        self.assertEqual(len(self.result()["points"]), 10)

    def test_reads_points_without_runs(self):
        self.assertEqual(self.measure(*TINY, "--parameters", "samples", document=scene("tiny")).returncode, 0)
        result = self.result()
        del result["points"][0]["runs"]
        result["points"][1]["runs"] = []
        pathlib.Path(f"{self.name}.json").write_text(json.dumps(result), encoding="utf-8")
        self.assertEqual(self.measure(*TINY, "--parameters", "samples", document=scene("tiny")).returncode, 0)
        for before, after in zip(result["points"][:2], self.result()["points"]):
            self.assertEqual(after["runs"][0], before["seconds"])
            self.assertGreater(len(after["runs"]), 1)

    def test_starts_over_for_another_scene_with_a_message(self):
        self.measure(*TINY, "--parameters", "samples", document=scene("tiny"))
        before = self.result()
        done = self.measure(*TINY, "--parameters", "samples", document=scene("tiny", ambient=0.9))
        self.assertIn(b"out.json has another scene, size or build: starting again\n", done.stderr)
        self.assertNotEqual(self.result()["key"], before["key"])
        self.assertNotEqual(self.result()["points"][0]["error"], before["points"][0]["error"])

    def test_continues_after_an_interruption(self):
        command = [BIN / "whittle", "measure", SCENES / "tiny.json", "-o", self.name, "--size", "96x96", "--reference-samples", "64"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        self.addCleanup(process.kill)  # does nothing after its end
        while process.poll() is None and not (os.path.exists(f"{self.name}.json") and self.result()["points"]):
            time.sleep(0.002)
        process.send_signal(signal.SIGINT)
        _, output = process.communicate(timeout=300)
        self.assertEqual(process.returncode, 130, output)
        self.assertIn(f"interrupted; rerun the command to resume from {self.name}.json".encode(), output)
        partial = self.result()
        self.assertFalse(partial["complete"])
        reference = pathlib.Path(f"{self.name}.reference").read_bytes()
        succeeded(subprocess.run(command, capture_output=True, check=False, timeout=600))
        whole = self.result()
        self.assertTrue(whole["complete"])
        self.assert_kept(partial["points"], whole["points"][:len(partial["points"])])
        self.assertGreater(len(whole["points"]), len(partial["points"]))
        self.assertEqual(pathlib.Path(f"{self.name}.reference").read_bytes(), reference)

    def test_computes_a_broken_reference_again(self):
        self.measure(*TINY, "--parameters", "samples", document=scene("tiny"))
        path = pathlib.Path(f"{self.name}.reference")
        whole = path.read_bytes()
        for broken in (b"", whole[:-1], b"whittle" + whole[10:], whole.replace(b" 32 24 ", b" 24 32 ", 1)):
            path.write_bytes(broken)
            self.assertEqual(self.measure(*TINY, "--parameters", "samples", document=scene("tiny")).returncode, 0)
            self.assertEqual(path.read_bytes(), whole)


class Output(Files):
    SAMPLES = ("--parameters", "samples")

    def test_has_the_table_with_quiet(self):
        done = self.measure(*TINY, *self.SAMPLES, "--quiet", document=scene("tiny"))
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        self.assertIn(b"- for 4 levels: ", done.stdout)

    def test_marks_broken_claims_in_red_on_a_terminal(self):
        self.assertEqual(self.measure(*TINY, *self.SAMPLES, path=SCENES / "tiny.json").returncode, 0)
        result = self.result()
        result["points"][2]["error"] = 2 * result["points"][2]["claimed"]["estimate"] + 1
        pathlib.Path(f"{self.name}.json").write_text(json.dumps(result), encoding="utf-8")
        command = [BIN / "whittle", "measure", SCENES / "tiny.json", "-o", self.name, *TINY, *self.SAMPLES, "--quiet"]
        self.assertIn(b"\n! samples 16 ", subprocess.run(command, capture_output=True, check=True).stdout)
        text = succeeded(on_terminal(*command)).stdout
        self.assertRegex(text, rb"\n\x1b\[31m! samples 16 [^\n]*\x1b\[0m\r\n")
        self.assertEqual(text.count(b"\x1b"), 2)


class Models(Files):
    """A ball on a plane under a sky: `--parameters model` compares the models of light."""

    PAINT = {"paint": {"model": "lambert", "color": [0.8, 0.6, 0.4]}}
    BALL = {"version": 1, "image": {"width": 12, "height": 9}, "accuracy": {"model": "global"}, "materials": PAINT,
            "camera": {"position": [0, 2, 6], "look_at": [0, 0.7, 0], "fov": 45}, "background": {"color": 0.3},
            "lights": [{"type": "point", "position": [4, 6, 5], "intensity": 0.4}],
            "objects": [{"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": "paint"},
                        {"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": "paint"}]}
    ROW = re.compile(r"(?m)^[*! ] model ([a-z ]+): (.+?)" + 6 * r" +([\d.]+)" + "$")

    def test_table_has_the_seconds_and_the_errors_of_each_model(self):
        done = succeeded(self.measure("--reference-samples", "1024", "--threads", "2", "--parameters", "model", document=self.BALL))
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


class Errors(Files):
    def test_of_the_scene_are_reported_with_exit_code_1(self):
        done = self.measure(document=scene("tiny", colour=1))
        self.assertEqual((done.returncode, done.stdout), (1, b""))
        self.assertIn(b"#/colour unknown_field ", done.stderr)
        self.assertEqual(list(self.directory.iterdir()), [])

    def test_include_an_output_that_is_no_measurement(self):
        pathlib.Path(f"{self.name}.json").write_text(json.dumps(scene("tiny")), encoding="utf-8")
        done = self.measure(*TINY, path=f"{self.name}.json")
        self.assertEqual(done.returncode, 3)
        self.assertIn(b"exists and is not a measurement of this version", done.stderr)
        self.assertEqual(self.result(), scene("tiny"))

    def test_of_the_directory_are_reported_with_exit_code_3(self):
        done = whittle("measure", "-", "-o", "/proc/none/out", *TINY, document=scene("tiny"))
        self.assertEqual(done.returncode, 3)
        self.assertIn(b"whittle: cannot write /proc/none/out.", done.stderr)

    def test_of_the_command_line_are_reported_with_exit_code_2(self):
        tiny = str(SCENES / "tiny.json")
        for sentence, *arguments in (
                ("SCENE is required",), ("The following argument was not expected: b", tiny, "b"),
                ("The following argument was not expected: --json", tiny, "--json"), ("-o: 1 required NAME missing", tiny, "-o"),
                ("-o: directory/: must be a name for the files", tiny, "-o", "directory/"),
                ("--size excludes --scale", tiny, "--size", "4x4", "--scale", "0.5"),
                ("--parameters: depth not in {target_error,samples,", tiny, "--parameters", "samples,depth"),
                ("--parameters: Samples not in {", tiny, "--parameters", "Samples"),
                *(("--parameters:  not in {", tiny, "--parameters", names)
                  for names in ("", ",", "samples,", ",samples", "samples,,cutoff")),
                *(("--size: must be WIDTHxHEIGHT", tiny, "--size", size) for size in ("4", "4x", "0x4", "4x4x4", "-1x4")),
                *(("--scale: must be a number > 0 and <= 1", tiny, "--scale", scale)
                  for scale in ("0", "1.1", "nan", "half")),
                *(("--reference-samples: must be an integer from 16 to ", tiny, "--reference-samples", count)
                  for count in ("15", "-1", "1e3")),
                ("--threads: must be an integer from 1 to 1024", tiny, "--threads", "0")):
            with self.subTest(arguments=arguments):
                done = whittle("measure", *arguments)
                self.assertEqual((done.returncode, done.stdout), (2, b""))
                self.assertRegex(done.stderr.decode(), rf"^whittle: {sentence}.*\nTry: whittle --help\n$")
