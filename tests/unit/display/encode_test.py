"""Encoders of image files: encode_image writes them, the readers of tests/support read them back."""
import subprocess
import unittest

import numpy

from tests.support import images
from tests.support.images import srgb_codes, srgb_curve
from tests.support.whittle import BIN

KINDS = ["png", "exr", "png16", "jpg", "hdr", "webp", "tiff"]
# Formats with straight alpha, their greatest code and their reader.
STRAIGHT = [("png", 255, images.read_png), ("png16", 65535, images.read_png), ("tiff", 65535, images.read_tiff)]


def run(kind, linear, *options, more=b""):
    height, width, _ = linear.shape
    return subprocess.run([BIN / "encode_image", kind, str(width), str(height), *options],
                          input=linear.astype("<f4").tobytes() + more, capture_output=True, check=False, timeout=300)


def encode(*arguments, **more):
    done = run(*arguments, **more)
    assert (done.returncode, done.stderr) == (0, b""), done.stderr.decode()
    return done.stdout


def noise(height, width):
    return numpy.random.default_rng(1).random((height, width, 3), numpy.float32)


def linear_from_srgb(value):
    return numpy.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def premultiplied(height, width):
    """Returns linear colour and alpha, with fully transparent and opaque pixels."""
    alpha = numpy.random.default_rng(4).integers(0, 5, (height, width)).astype(numpy.float32) / 4
    return noise(height, width) * alpha[..., None], alpha


def straight_codes(linear, alpha, most):
    straight = numpy.where(alpha[..., None] > 0, linear / numpy.maximum(alpha, 1e-9)[..., None], 0)
    codes = srgb_codes(straight.astype(numpy.float32), most)
    return numpy.dstack([codes, numpy.floor(alpha * most + 0.5).astype(codes.dtype)])


class Png(unittest.TestCase):
    def test_contains_images_that_are_compressed_in_several_strips(self):
        linear = noise(401, 307)
        data = [content for kind, content in images.png_chunks(encode("png", linear)) if kind == b"IDAT"]
        self.assertGreater(len(data), 2)
        numpy.testing.assert_array_equal(images.read_png(encode("png", linear)), srgb_codes(linear))
        numpy.testing.assert_array_equal(images.read_png(encode("png16", linear)), srgb_codes(linear, 65535))
        one_row = noise(1, 50_000)  # more than one strip holds
        numpy.testing.assert_array_equal(images.read_png(encode("png", one_row)), srgb_codes(one_row))

    def test_clamps_to_the_displayable_range_and_maps_nan_to_black(self):
        linear = numpy.array([[[-1, 2, numpy.nan], [numpy.inf, -numpy.inf, 1e30]]])
        self.assertEqual(images.read_png(encode("png", linear))[0].tolist(), [[0, 255, 0], [255, 0, 255]])

    def test_declares_srgb_and_contains_no_time_and_no_host(self):
        chunks = images.png_chunks(encode("png", noise(2, 2)))
        self.assertIn(b"sRGB", dict(chunks))
        self.assertLessEqual(set(dict(chunks)), {b"IHDR", b"sRGB", b"gAMA", b"cHRM", b"oFFs", b"tEXt", b"IDAT", b"IEND"})
        self.assertLessEqual({content for kind, content in chunks if kind == b"tEXt"}, {b"oiio:ColorSpace\0sRGB"})


class Exr(unittest.TestCase):
    def test_contains_every_float_bit_by_bit(self):
        linear = numpy.random.default_rng(2).integers(0, 1 << 32, (53, 41, 3), numpy.uint32).view(numpy.float32)
        back = images.read_exr(encode("exr", linear))
        numpy.testing.assert_array_equal(back.view(numpy.uint32), linear.view(numpy.uint32))

    def test_contains_smooth_images_whose_blocks_are_compressed(self):
        y, x = numpy.mgrid[0:70, 0:90].astype(numpy.float32)
        linear = numpy.stack([x / 90, y / 70, 5 * x * y], axis=-1).astype(numpy.float32)
        data = encode("exr", linear)
        self.assertLess(len(data), linear.nbytes)
        numpy.testing.assert_array_equal(images.read_exr(data), linear)

    def test_contains_the_nearest_16_bit_floats_with_half(self):
        values = numpy.random.default_rng(7).integers(0, 0x477FF000, (53, 40, 3), numpy.uint32).view(numpy.float32)
        values[0, :4, 0] = [65504, 65519, 1e30, 2.0**-24 * 1.5]
        expected = numpy.minimum(values, 65504).astype(numpy.float16)
        data = encode("exr", values, "half")
        self.assertEqual(images.read_exr(data).dtype, numpy.float16)
        numpy.testing.assert_array_equal(images.read_exr(data), expected)
        error = float(encode("exr", noise(53, 41), "half", "error"))
        self.assertGreater(error, 0.001)
        self.assertLess(error, 255 / 2.4 / 2**11)

    def test_contains_layers_as_channels_beside_16_or_32_bit_colours(self):
        linear, alpha = premultiplied(19, 33)
        depth, error = noise(19, 33)[..., 0], noise(19, 33)[..., 1]
        depth[3, 4] = numpy.inf
        ids = numpy.random.default_rng(5).integers(0, 1 << 32, (19, 33), numpy.uint32)
        layers = {"Z": depth, "object_id": ids, "error": error}
        more = b"".join(layer.tobytes() for layer in (alpha, *layers.values()))
        for options, number in (([], numpy.float32), (["half"], numpy.float16)):
            channels = images.read_exr_channels(encode("exr", linear, "alpha", "layers", *options, more=more))
            colours = {name: linear[..., i].astype(number) for i, name in enumerate("RGB")}
            expected = {"A": alpha.astype(number), **colours, **layers}
            self.assertEqual(sorted(channels), sorted(expected))
            for name, values in expected.items():
                numpy.testing.assert_array_equal(channels[name], values, err_msg=name)

    def test_contains_no_time(self):
        attributes, _ = images.exr_header(encode("exr", noise(2, 2)))
        self.assertEqual(attributes.get("capDate", ("string", b""))[1], b"")
        self.assertLessEqual(set(attributes), {"capDate", "channels", "compression", "dataWindow", "displayWindow",
                                               "lineOrder", "pixelAspectRatio", "screenWindowCenter",
                                               "screenWindowWidth"})


class Alpha(unittest.TestCase):
    def test_is_straight_in_png_and_tiff(self):
        linear, alpha = premultiplied(23, 31)
        for kind, most, read in STRAIGHT:
            back = read(encode(kind, linear, "alpha", more=alpha.tobytes()))
            numpy.testing.assert_allclose(back.astype(int), straight_codes(linear, alpha, most).astype(int), atol=1,
                                          err_msg=kind)

    def test_is_composited_over_black_to_measure_the_error_of_the_file(self):
        linear, alpha = premultiplied(23, 31)
        shown = 255 * srgb_curve(linear)
        for kind, most, read in STRAIGHT:
            for options in ([], ["palette"]):
                codes = read(encode(kind, linear, "alpha", *options, more=alpha.tobytes())) / most
                over_black = 255 * srgb_curve(linear_from_srgb(codes[..., :3]) * codes[..., 3:])
                error = float(encode(kind, linear, "alpha", *options, "error", more=alpha.tobytes()))
                self.assertAlmostEqual(error, float(numpy.sqrt(numpy.mean((over_black - shown) ** 2))), delta=2e-4,
                                       msg=(kind, options))

    def test_is_premultiplied_in_exr(self):
        linear, alpha = premultiplied(23, 31)
        channels = images.read_exr_channels(encode("exr", linear, "alpha", more=alpha.tobytes()))
        self.assertEqual(sorted(channels), ["A", "B", "G", "R"])
        numpy.testing.assert_array_equal(channels["G"], linear[..., 1])


class OtherFormats(unittest.TestCase):
    def test_radiance_contains_linear_values_with_a_shared_exponent(self):
        linear = noise(37, 61) * 100
        back, step = images.read_hdr(encode("hdr", linear))
        self.assertLessEqual(float(numpy.max(numpy.abs(back - linear) / step[..., None])), 1.0)

    def test_jpeg_has_signature_and_size(self):
        jpeg = encode("jpg", noise(37, 61))
        self.assertTrue(jpeg.startswith(b"\xff\xd8\xff") and jpeg.endswith(b"\xff\xd9"))
        frame = jpeg.index(b"\xff\xc0")
        self.assertEqual(jpeg[frame + 4 : frame + 10], bytes([8, 0, 37, 0, 61, 3]))
        self.assertEqual(jpeg[frame + 11], 0x11, "no subsampling")

    def test_tiff_contains_no_time(self):
        tags = images.tiff_tags(encode("tiff", noise(37, 61)))
        self.assertNotIn(306, tags, "DateTime")
        self.assertNotIn(305, tags, "Software")

    def test_webp_contains_uniform_images(self):
        grey = numpy.full((16, 16, 3), 0.5)
        self.assertNotEqual(encode("webp", grey), encode("webp", grey / 2))
        self.assertEqual(encode("webp", grey), encode("webp", grey, "palette"))

    def test_palette_limits_the_colours_of_8_bit_png_only(self):
        linear = noise(40, 40)
        colors = numpy.unique(images.read_png(encode("png", linear, "palette")).reshape(-1, 3), axis=0)
        self.assertEqual(len(colors), 16)
        self.assertEqual(encode("png16", linear, "palette"), encode("png16", linear))

    def test_palette_makes_an_indexed_file_unless_there_is_alpha(self):
        linear, alpha = premultiplied(40, 40)
        chunks = images.png_chunks(encode("png", linear, "palette"))
        self.assertEqual(chunks[0][1][8:10], bytes([8, 3]), "8 bits, indexed")
        self.assertEqual(len(dict(chunks)[b"PLTE"]), 3 * 16)
        with_alpha = images.png_chunks(encode("png", linear, "alpha", "palette", more=alpha.tobytes()))
        self.assertEqual(with_alpha[0][1][8:10], bytes([8, 6]))

    def test_quality_changes_the_size_and_the_error_of_lossy_formats(self):
        linear = noise(64, 64)
        for kind in ("jpg", "webp"):
            files = [encode(kind, linear, f"quality={quality}") for quality in (20, 60, 95)]
            errors = [float(encode(kind, linear, f"quality={quality}", "error")) for quality in (20, 60, 95)]
            sizes = [len(file) for file in files]
            self.assertEqual(sorted(set(sizes)), sizes, kind)
            self.assertEqual(sorted(set(errors), reverse=True), errors, kind)
            self.assertEqual(files[2], encode(kind, linear), "the default")


class Encoders(unittest.TestCase):
    def test_keep_every_value_also_of_one_pixel_row_or_column(self):
        for height, width in [(37, 61), (1, 1), (1, 300), (300, 1), (17, 1)]:
            linear = noise(height, width)
            for kind, most, read in STRAIGHT:
                with self.subTest(kind=kind, height=height, width=width):
                    numpy.testing.assert_array_equal(read(encode(kind, linear)), srgb_codes(linear, most))
            numpy.testing.assert_array_equal(images.read_exr(encode("exr", linear)), linear)

    def test_write_equal_bytes_for_equal_images(self):
        for kind in KINDS:
            self.assertEqual(encode(kind, noise(300, 200)), encode(kind, noise(300, 200)), kind)

    def test_reject_images_without_pixels(self):
        for kind in KINDS:
            done = run(kind, numpy.zeros((0, 0, 3)))
            self.assertEqual(done.returncode, 1, kind)
            self.assertRegex(done.stderr.decode(), r"encoder: .+")
