"""whittle diff: metrics compared with numpy, formats, exit codes and invalid files."""
import json
import math
import unittest

import numpy

from tests.support import images
from tests.support.whittle import BIN, SOURCE, DirectoryTest, scene, succeeded, temporary_directory, whittle

CORPUS = BIN.parent / "corpus" / "image"


class Diff(unittest.TestCase):
    """Two renders of a scene with 64 x 48 pixels: one sample for each pixel, and many."""

    @classmethod
    def setUpClass(cls):
        cls.directory = temporary_directory(cls)
        kinds = ("png", "16.png", "exr", "hdr", "jpg", "webp", "tiff")
        for name, samples in (("few", 1), ("many", 36)):
            document = scene("whitted", image={"width": 64, "height": 48}, accuracy={"samples": [samples, samples]})
            outputs = [part for kind in kinds for part in ("-o", cls.directory / f"{name}.{kind}")]
            succeeded(whittle("render", "-", "--quiet", *outputs, document=document))
        cls.few, cls.many = (images.read_png((cls.directory / f"{name}.png").read_bytes()).astype(float) for name in ("few", "many"))

    def diff(self, a, b, *options, **more):
        return whittle("diff", *(name if name == "-" else self.directory / name for name in (a, b)), *options, **more)

    def figures(self, *arguments, code=0):
        done = self.diff(*arguments, "--json")
        self.assertEqual((done.returncode, done.stderr), (code, b""))
        return json.loads(done.stdout)

    def test_metrics_equal_those_of_numpy(self):
        found = self.figures("many.png", "few.png")
        difference = self.few - self.many
        self.assertGreater(found["rmse"], 1, "the images are too similar for the test")
        self.assertEqual((found["width"], found["height"]), (64, 48))
        self.assertAlmostEqual(found["rmse"], math.sqrt((difference**2).mean()), places=12)
        numpy.testing.assert_allclose(found["rmse_channel"], numpy.sqrt((difference**2).mean((0, 1))), rtol=1e-14)
        self.assertAlmostEqual(found["bias"], difference.mean(), places=12)
        self.assertEqual(found["greatest"], abs(difference).max())
        self.assertAlmostEqual(found["psnr_db"], 10 * math.log10(255**2 / (difference**2).mean()), places=11)
        self.assertTrue(0 < found["ssim"] < 1)
        self.assertEqual(found["differing"], (abs(difference).max(-1) > 1).mean())

    def test_text_has_the_same_values_as_json(self):
        done = self.diff("many.png", "few.png", "--worst", "1")
        found = self.figures("many.png", "few.png")
        text, worst = done.stdout.decode(), found["worst"][0]
        self.assertIn(f"rmse       {found['rmse']:.4f} levels (red {found['rmse_channel'][0]:.4f},", text)
        self.assertIn(f"bias       {found['bias']:+.4f} levels (mean of b - a)\n", text)
        self.assertIn(f"psnr       {found['psnr_db']:.2f} dB\n", text)
        self.assertIn(f"ssim       {found['ssim']:.6f} of the luma\n", text)
        self.assertIn(f"differing  {100 * found['differing']:.4f} % of the pixels by more than one level\n", text)
        self.assertRegex(text, rf"\n +{worst['x']} +{worst['y']} +{worst['difference']:.2f} ")
        self.assertEqual((done.returncode, done.stderr), (0, b""))

    def test_reads_every_output_format_and_prints_which_are_linear(self):
        # Losses of the formats: rounding to code values, chroma subsampling, mantissas of eight bits.
        for kind, name, linear, at_most in (("png", "PNG", False, 0.5), ("16.png", "PNG", False, 0.005),
                                            ("exr", "OpenEXR", True, 0), ("hdr", "Radiance HDR", True, 2),
                                            ("jpg", "JPEG", False, 10), ("webp", "WebP", False, 30),
                                            ("tiff", "TIFF", False, 0.005)):
            with self.subTest(kind=kind):
                found = self.figures("many.exr", f"many.{kind}")
                self.assertEqual(found["formats"], ["OpenEXR", name])
                self.assertLessEqual(found["rmse"], at_most)
                output = self.diff("many.exr", f"many.{kind}").stdout.decode().splitlines()[1]
                how = "linear: exposure 0, clamped, encoded as sRGB" if linear else "sRGB"
                self.assertEqual(output, f"b          {self.directory}/many.{kind} ({name}, {how})")

    def test_reports_equal_images(self):
        found = self.figures("few.png", "few.png", "--tolerance", "0")
        self.assertEqual((found["rmse"], found["psnr_db"], found["ssim"], found["worst"]), (0, None, 1, []))
        self.assertIs(found["within_tolerance"], True)
        self.assertIn(b"psnr       infinite: the images are equal\n", self.diff("few.png", "few.png").stdout)

    def test_exit_code_is_1_only_if_the_error_exceeds_the_tolerance(self):
        rmse = self.figures("many.png", "few.png")["rmse"]
        for tolerance, code in ((repr(rmse), 0), (repr(math.nextafter(rmse, 0)), 1), ("1000", 0), ("0", 1)):
            found = self.figures("many.png", "few.png", "--tolerance", tolerance, code=code)
            self.assertEqual((found["tolerance"], found["within_tolerance"]), (float(tolerance), code == 0))
        self.assertIn(b"result     rmse above the tolerance of 0.5 levels\n", self.diff("many.png", "few.png", "--tolerance", "0.5").stdout)

    def test_writes_the_heat_map_and_prints_its_scale(self):
        for options in ((), ("--heat-white", "40")):
            found = self.figures("many.png", "few.png", "--heat", self.directory / "heat.png", *options)
            white = found["heat_white"]
            self.assertTrue(8 * found["rmse"] <= white < 16 * found["rmse"] if not options else white == 40, white)
            heat, most = images.read_png((self.directory / "heat.png").read_bytes()), abs(self.few - self.many).max(-1)
            self.assertTrue((heat[most == 0] == 0).all() and (heat[most >= white] == 255).all())
        output = self.diff("many.png", "few.png", "--heat", self.directory / "heat.png", "--heat-white", "40").stdout
        self.assertIn(f"heat map   {self.directory}/heat.png: black 0, white 40 levels\n".encode(), output)

    def test_reads_one_of_the_images_from_standard_input(self):
        done = self.diff("-", "few.png", "--json", document=(self.directory / "many.png").read_bytes())
        self.assertEqual(json.loads(done.stdout), self.figures("many.png", "few.png"))


class Errors(DirectoryTest):
    GOOD = CORPUS / "good_rgb.png"

    def expect(self, code, sentence, *arguments, **more):
        done = whittle("diff", *arguments, **more)
        self.assertEqual((done.returncode, done.stdout), (code, b""), done.stderr)
        self.assertRegex(done.stderr.decode(errors="replace"), rf"(?m)^whittle: {sentence}")

    def test_of_a_file_are_reported_by_name(self):
        for arguments in ((self.directory / "none.png", self.GOOD), (self.GOOD, self.directory / "none.png")):
            self.expect(3, rf"cannot read {self.directory}/none.png: No such file or directory\n", *arguments)
        self.expect(3, rf"cannot read {self.directory}: Is a directory\n", self.directory, self.GOOD)
        self.expect(2, "- is no PNG, JPEG, TIFF, WebP, OpenEXR or Radiance HDR file\n", "-", self.GOOD, document=b"")
        text = SOURCE / "README.md"
        self.expect(2, rf"{text} is no PNG, JPEG, TIFF, WebP, OpenEXR or Radiance HDR file\n", text, self.GOOD)
        cut = self.directory / "cut.png"
        cut.write_bytes(self.GOOD.read_bytes()[:-20])
        self.expect(2, rf"{cut} is truncated: its last chunk is not within the file\n", cut, self.GOOD)

    def test_of_every_corrupt_file_are_reported_with_exit_code_2(self):
        readable = {"bad_nine_channels.exr", "bad_other_reader.tif"}  # invalid as textures only
        bad = [path for path in sorted(CORPUS.iterdir()) if path.name.startswith("bad_") and path.name not in readable]
        self.assertGreater(len(bad), 20)
        for path in bad:
            with self.subTest(path=path.name):
                self.expect(2, rf"{path} \S.*\n", path, self.GOOD)

    def test_of_different_sizes_are_reported_with_both_sizes(self):
        self.expect(2, r"the sizes differ: 8 x 4 and 640 x 480 pixels\n", self.GOOD, SOURCE / "scenes" / "images" / "whitted.png")

    def test_of_the_command_line_are_reported_with_exit_code_2(self):
        good = str(self.GOOD)
        for sentence, *arguments in (
                ("A is required",), ("B is required", good),
                ("The following argument was not expected: c.png", good, good, "c.png"),
                ("diff: only one of the images can be standard input", "-", "-"), ("B: the file name is empty", good, ""),
                ("The following arguments? (was|were) not expected: --threads", good, good, "--threads"),
                ("--heat: 1 required FILE.png missing", good, good, "--heat"),
                ("--heat: heat.jpg: the name must end in .png", good, good, "--heat", "heat.jpg"),
                ("--heat: would replace an image that is compared", good, good, "--heat", good),
                ("--heat-white requires --heat", good, good, "--heat-white", "3"),
                ("--heat-white: must be a number > 0, got \"0\"", good, good, "--heat-white", "0"),
                *(("--tolerance: must be a number >= 0, got", good, good, "--tolerance", value)
                  for value in ("-1", "nan", "inf", "1x", "")),
                *(("--worst: must be an integer from 0 to 100000, got", good, good, "--worst", value)
                  for value in ("-1", "1.5", "100001", ""))):
            with self.subTest(arguments=arguments):
                self.expect(2, sentence, *arguments)

    def test_of_the_heat_map_are_reported_with_exit_code_3(self):
        self.expect(3, "cannot write /proc/heat.png: ", self.GOOD, self.GOOD, "--heat", "/proc/heat.png")
