"""The command line of whittle: output, streams and exit codes."""
import contextlib
import json
import os
import pathlib
import pty
import re
import signal
import subprocess
import unittest

import numpy

from tests.http.daemon import Daemon
from tests.support import images
from tests.support.whittle import BIN, SCENES, DirectoryTest, scene, succeeded, temporary_directory, whittle

ISSUE_LINE = re.compile(r"^#\S* [a-z_]+ \S.*$")


class Render(DirectoryTest):
    def render(self, document, *names, options=()):
        outputs = [part for name in names for part in ("-o", self.directory / name)]
        return whittle("render", "-", *outputs, *options, document=document)

    def test_writes_png_and_exr_of_one_image(self):
        succeeded(self.render(scene("tiny"), "a.png", "a.exr"))
        png = images.read_png((self.directory / "a.png").read_bytes())
        exr = images.read_exr((self.directory / "a.exr").read_bytes())
        self.assertEqual(png.shape, (16, 16, 3))
        self.assertGreater(len(numpy.unique(png)), 10, "the image is nearly uniform")
        numpy.testing.assert_array_equal(png, images.srgb_codes(exr))

    def test_reports_as_json_what_the_service_reports(self):
        report = self.directory / "report.json"
        done = self.render(scene("tiny"), "a.png", "a.exr", options=("--report", report, "--quiet"))
        self.assertEqual((done.returncode, done.stdout), (0, b""), done.stderr)
        written = json.loads(report.read_text("utf-8"))
        with Daemon() as daemon:
            document = scene("tiny", output={"formats": ["png", "exr"]})
            served = daemon.wait_for_end(daemon.submit(document))["report"]
        self.assertEqual([pathlib.Path(artifact["name"]).name for artifact in written["artifacts"]], ["a.png", "a.exr"])
        for varying in ("time_ms", "artifacts", "geometry_reused", "textures"):
            self.assertEqual(type(written.pop(varying)), type(served.pop(varying)))
        self.assertEqual(written, served)
        done = self.render(scene("tiny"), "a.png", options=("--report", "-"))
        self.assertEqual(json.loads(done.stdout)["rays"], written["rays"])
        self.assertIn(b"time ", done.stderr)

    def test_reports_nothing_without_a_place_for_it(self):
        done = self.render(scene("tiny"), "a.png", options=("--report", self.directory / "none" / "report.json"))
        self.assertEqual(done.returncode, 3)
        self.assertFalse((self.directory / "a.png").exists())

    def exr(self, document):
        succeeded(self.render(document, "image.exr"))
        return images.read_exr((self.directory / "image.exr").read_bytes())

    def test_omits_shadows_of_objects_without(self):
        def document(objects, **more):
            return {"version": 1, "image": {"width": 48, "height": 36}, "accuracy": {"samples": 1},
                    "camera": {"position": [0, 6, 6], "look_at": [0, 0, 0]},
                    "lights": [{"type": "point", "position": [0, 9, 0]}],
                    "prototypes": {"ball": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": {}}]},
                    "objects": [{"material": {}, **each} for each in ({"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0]}, *objects)],
                    **more}
        floor = self.exr(document([]))
        maps = {"accuracy": {"samples": 1, "approximate": {"shadows": "map"}}}
        ball = {"type": "sphere", "center": [0, 2, 0], "radius": 1}
        glass = {**ball, "material": {"transmission": 0.5, "absorption": 2}}
        corners = [[-1, 2, -1], [1, 2, -1], [0, 2, 1]]
        for each, options in (
                (ball, {}), (ball, maps), (glass, {}), (glass, maps), ({"type": "box", "center": [0, 2, 0], "size": 1}, {}),
                ({"type": "triangle", "vertices": corners}, {}), ({"type": "mesh", "positions": corners, "triangles": [[0, 1, 2]]}, {}),
                ({"type": "plane", "point": [0, 8, 0], "normal": [0, 1, 0]}, {}), ({"type": "instance", "of": "ball", "position": [0, 2, 0]}, {})):
            with self.subTest(each, **options):
                dark = self.exr(document([each], **options))
                lit = self.exr(document([{**each, "shadow": False}], **options))
                # Where the object itself is not visible, its image without shadow is the floor alone.
                covered = self.exr(document([{**each, "shadow": False, "material": {"emission": 5}}])) > 1
                numpy.testing.assert_array_equal(lit[~covered], floor[~covered])
                if each is not glass or not options:
                    self.assertTrue((dark != lit)[~covered].any())

    def test_reads_a_file_or_standard_input(self):
        succeeded(whittle("render", SCENES / "tiny.json", "-o", self.directory / "file.png"))
        self.render(scene("tiny"), "input.png")
        self.assertEqual((self.directory / "file.png").read_bytes(), (self.directory / "input.png").read_bytes())

    def test_writes_the_same_bytes_with_1_2_and_5_threads(self):
        document = scene("whitted", image={"width": 96, "height": 72}, accuracy={"samples": [4, 4]})
        bytes_of = {}
        for threads in (1, 2, 5):
            succeeded(self.render(document, f"{threads}.png", f"{threads}.exr", options=("--threads", threads)))
            bytes_of[threads] = [(self.directory / f"{threads}.{kind}").read_bytes() for kind in ("png", "exr")]
        self.assertEqual(bytes_of[1], bytes_of[2])
        self.assertEqual(bytes_of[1], bytes_of[5])

    def test_prints_the_summary_on_standard_error_and_nothing_on_standard_output(self):
        done = self.render(scene("tiny", accuracy={"samples": 1}), "a.png")
        figures = done.stderr.decode()
        self.assertEqual(done.stdout, b"")
        self.assertIn("image      16 x 16, 256 samples\n", figures)
        rays = {kind: int(count) for kind, count in re.findall(r"^(\w+) +(\d+) rays +[\d.]+ million/s$", figures, re.M)}
        self.assertEqual(rays["camera"], 256)
        self.assertGreater(rays["shadow"], 0)
        self.assertGreater(rays["reflection"], 0)
        self.assertNotIn("refraction", rays, "a kind without rays")
        self.assertEqual(rays["all"], sum(rays.values()) - rays["all"])
        self.assertRegex(figures, r"time +parse [\d.]+ ms, build [\d.]+ ms, trace [\d.]+ ms, encode [\d.]+ ms\n")
        self.assertIn(f"{self.directory}/a.png, {(self.directory / 'a.png').stat().st_size} bytes", figures)

    def test_ends_within_its_time_budget_and_prints_the_error(self):
        document = scene("cornell", image={"width": 96, "height": 72}, accuracy={"time_budget_ms": 200})
        done = succeeded(self.render(document, "a.png"))
        rays = int(re.search(r"^camera +(\d+) rays", done.stderr.decode(), re.MULTILINE).group(1))
        self.assertGreaterEqual(rays, 96 * 72 // 256)
        self.assertLess(rays, 4096 * 96 * 72 // 4, "a quarter of the samples without a budget")
        self.assertRegex(done.stderr.decode(), r"error +at most [0-9.]+ levels")

    def test_prints_if_the_target_error_is_reached(self):
        image = {"width": 48, "height": 36}
        reached = self.render(scene("cornell", image=image, accuracy={"target_error": 2}), "a.png", options=("--require-target",))
        self.assertRegex(reached.stderr.decode(), r"error +at most [01]\.[0-9]+ levels \(95 % confidence\)\n")
        missed = [self.render(scene("cornell", image=image, accuracy={"target_error": 0.1, "samples": [1, 4]}), "a.png", options=options)
                  for options in ((), ("--require-target",))]
        self.assertEqual([each.stderr.decode().splitlines()[-1] for each in (reached, *missed)],
                         ["target 2: met", *["target 0.1: missed, samples_max is reached everywhere"] * 2])
        self.assertEqual([each.returncode for each in (reached, *missed)], [0, 0, 1])

    def test_prints_nothing_with_quiet(self):
        done = self.render(scene("tiny"), "a.png", options=("--quiet",))
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, b"", b""))

    def test_shows_no_progress_bar_without_a_terminal(self):
        done = succeeded(self.render(scene("sphereflake", image={"width": 256, "height": 256}), "a.png"))
        self.assertNotIn(b"\r", done.stderr)
        self.assertNotIn(b"\x1b", done.stderr)

    def test_prints_all_issues_of_an_invalid_scene_and_writes_nothing(self):
        document = scene("tiny", camera={"position": [0, 0, 0], "look_at": [0, 0, 0], "fov": 400}, colour=1)
        done = self.render(document, "a.png")
        self.assertEqual(done.returncode, 1)
        lines = done.stderr.decode().splitlines()
        self.assertGreaterEqual(len(lines), 3)
        for line in lines:
            self.assertRegex(line, ISSUE_LINE)
        self.assertEqual(list(self.directory.iterdir()), [])


class Interruption(DirectoryTest):
    """Long renders that are stopped once their progress bar shows that they are running."""

    def stop_with(self, signal_number):
        document = scene("sphereflake", image={"width": 4096, "height": 2048}, accuracy={"samples": [1024, 1024]})
        path, out = self.directory / "long.json", self.directory / "out"
        path.write_text(json.dumps(document), encoding="utf-8")
        out.mkdir(exist_ok=True)
        master, slave = pty.openpty()
        process = subprocess.Popen([BIN / "whittle", "render", path, "-o", out / "a.png", "-o", out / "a.exr"],
                                   stderr=slave, stdin=subprocess.DEVNULL)
        os.close(slave)
        self.addCleanup(os.close, master)
        self.addCleanup(process.kill)  # does nothing after its end
        shown = b""
        while b"%" not in shown:
            shown += os.read(master, 4096)
        process.send_signal(signal_number)
        with contextlib.suppress(OSError):  # as the process closes the terminal
            while True:
                shown += os.read(master, 4096)
        return process.wait(timeout=300), shown.decode()

    def test_by_sigint_or_sigterm_is_reported_and_leaves_no_file(self):
        for signal_number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(signal=signal_number):
                code, shown = self.stop_with(signal_number)
                self.assertEqual(code, 130, shown)
                self.assertIn("interrupted; nothing was written", shown)
                self.assertEqual(list((self.directory / "out").iterdir()), [])


class Check(unittest.TestCase):
    def test_prints_the_requirements_of_a_valid_scene(self):
        done = whittle("check", SCENES / "tiny.json")
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        first, *needs, light = done.stdout.decode().splitlines()
        self.assertEqual(first, "valid; requires:")
        self.assertRegex(light, "^global light +adds light between surfaces of 2 diffuse colors ")
        self.assertEqual(dict(line.split() for line in needs),
                         {"reflection": "#/objects/0/material", "shadows": "#/lights/0", "spheres": "#/objects/0",
                          "planes": "#/objects/1"})

    def test_names_the_parts_that_need_global_light(self):
        paper = {"model": "lambert", "color": 0.5, "diffuse": 0.5, "diffuse_transmission": 0.5}
        document = scene("tiny", materials={"paper": paper, "lamp": {"diffuse": 0, "emission": 4}}, ambient=0,
                         accuracy={"model": "global", "approximate": {"interreflection": "radiosity"}})
        for each, material in zip(document["objects"], ("paper", "lamp")):
            each["material"] = material
        document["objects"].append({"type": "sphere", "center": [0, 5, 0], "radius": 1, "material": "lamp"})
        lines = whittle("check", "-", document=document).stdout.decode().splitlines()
        needs = dict(line.split() for line in lines if line.startswith("  "))
        self.assertEqual({name: needs.get(name) for name in ("global_light", "emitters", "transmitted_light", "interreflection",
                                                              "approximations")},
                         {"global_light": "#/accuracy/model", "emitters": "#/materials/lamp",
                          "transmitted_light": "#/materials/paper", "interreflection": "#/accuracy/approximate/interreflection",
                          "approximations": "#/accuracy/approximate"})

    def test_prints_warnings_of_a_valid_scene(self):
        document = scene("tiny", camera={"position": [0, 1, 5], "look_at": [0, 0.5, 0], "fov": 0.7})
        done = whittle("check", "-", document=document)
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        lines = done.stdout.decode().splitlines()
        self.assertEqual([line for line in lines if line.startswith("warning ")],
                         ["warning #/camera/fov radians angles are in degrees, got 0.7: is it in radians?"])
        done = whittle("render", "-", "-o", temporary_directory(self) / "image.png", document=document)
        self.assertEqual(done.returncode, 0)
        self.assertIn(b"warning #/camera/fov radians ", done.stderr)

    def test_prints_each_issue_as_a_line_of_pointer_code_and_message(self):
        document = scene("tiny")
        document["objects"][0]["radius"] = -1
        document["objects"][1]["material"] = "glas"
        document["lamps"] = []
        done = whittle("check", "-", document=document)
        self.assertEqual((done.returncode, done.stderr), (1, b""))
        lines = done.stdout.decode().splitlines()
        for line in lines:
            self.assertRegex(line, ISSUE_LINE)
        issues = {tuple(line.split(" ")[:2]) for line in lines}
        self.assertEqual(issues, {("#/objects/0/radius", "out_of_range"), ("#/lamps", "unknown_field"),
                                  ("#/objects/1/material", "unknown_reference")})

    def test_escapes_control_characters_and_spaces_in_pointers(self):
        document = scene("tiny")
        document["materials"] = {"my\nred \x1b[31m": {"ior": -1}}
        done = whittle("check", "-", document=document)
        self.assertEqual(done.returncode, 1)
        self.assertNotIn(b"\x1b", done.stdout)
        (line,) = done.stdout.decode().splitlines()
        self.assertTrue(line.startswith("#/materials/my%0Ared%20%1B%5B31m/ior out_of_range "), line)

    def test_prints_the_place_of_a_json_error_or_that_the_document_is_too_large(self):
        for document, line in (('{\n  "version": 1,\n  oops\n}', "line 3, column 3 not_json"), (b"[" * ((64 << 20) + 1), "# too_large")):
            done = whittle("check", "-", document=document)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stdout.decode(), rf"^{line} \S.*\n$")

    def test_prints_the_result_as_json_with_the_option_json(self):
        valid = succeeded(whittle("check", "--json", SCENES / "tiny.json"))
        result = json.loads(valid.stdout)
        self.assertEqual((result["valid"], result["errors"]), (True, []))
        self.assertTrue(result["requirements"]["reflection"])
        self.assertTrue(result["global_light"].startswith("adds light between surfaces of "), result["global_light"])
        for document, code in [('{"version": 2}', None), ("{", "not_json"), (b"[" * ((64 << 20) + 1), "too_large")]:
            bad = whittle("check", "-", "--json", document=document)
            self.assertEqual(bad.returncode, 1)
            result = json.loads(bad.stdout)
            self.assertFalse(result["valid"])
            self.assertTrue(all(set(error) == {"pointer", "code", "detail"} for error in result["errors"]))
            if code:
                self.assertEqual([error["code"] for error in result["errors"]], [code])

    def test_fails_if_its_output_cannot_be_written(self):
        with open("/dev/full", "wb") as full:
            done = subprocess.run([BIN / "whittle", "check", SCENES / "tiny.json"], stdout=full, check=False, timeout=300)
        self.assertEqual(done.returncode, 3)


class CommandLine(unittest.TestCase):
    def test_with_an_error_is_explained_with_exit_code_2(self):
        tiny = str(SCENES / "tiny.json")
        for arguments in [[], ["draw"], ["render"], ["render", tiny], ["render", tiny, "-o"], ["render", tiny, "-o", "a"],
                          ["render", tiny, "-o", "a.bmp"], ["render", tiny, "-o", "a.png", "-o", "a.png"],
                          ["render", tiny, tiny, "-o", "a.png"], ["render", tiny, "-o", "a.png", "--threads"],
                          ["render", tiny, "-o", "a.png", "--threads", "0"], ["render", "", "-o", "a.png"],
                          ["render", tiny, "-o", "a.png", "--threads", "2x"], ["render", tiny, "-o", "a.png", "--json"],
                          ["render", tiny, "-o", "a.png", "--threads", "99999999999"], ["check"],
                          ["check", tiny, "--quiet"], ["check", tiny, tiny], ["check", "--what", tiny]]:
            with self.subTest(arguments=arguments):
                done = whittle(*arguments)
                self.assertEqual((done.returncode, done.stdout), (2, b""))
                self.assertRegex(done.stderr.decode(), r"^whittle: \S.*\nTry: whittle --help\n$")

    def test_help_lists_commands_options_and_exit_codes_on_standard_output(self):
        commands = (b"render", b"check", b"diff", b"measure", b"--version", b"Exit codes")
        for arguments, words in ((["--help"], commands), (["-h"], commands),
                                 (["render", "--help"], (b"whittle render", b"SCENE", b"--threads", b"Exit codes")),
                                 (["check", "scene.json", "--help"], (b"whittle check", b"--json", b"Exit codes"))):
            done = whittle(*arguments)
            self.assertEqual((done.returncode, done.stderr), (0, b""))
            for word in words:
                self.assertIn(word, done.stdout)

    def test_version_prints_the_build(self):
        done = succeeded(whittle("--version"))
        self.assertRegex(done.stdout.decode(), r"^whittle \d+\.\d+\.\d+(\+g[0-9a-f]+(-dirty)?)?\n$")
