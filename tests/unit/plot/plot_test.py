"""Plots of draw_plot: the SVG parsed as XML, the PNG read by tests/support."""
import math
import re
import subprocess
import unittest
from xml.etree import ElementTree

import numpy

from tests.support import images
from tests.support.whittle import BIN

SVG = "{http://www.w3.org/2000/svg}"
BLUE, VERMILION = "#0072b2", "#d55e00"


def draw(kind, *lines):
    """Returns the bytes of the plot; each line is a tuple of words, as draw_plot.cpp reads them."""
    text = b"".join(b"\t".join(w if isinstance(w, bytes) else str(w).encode() for w in line) + b"\n" for line in lines)
    done = subprocess.run([BIN / "draw_plot", kind], input=text, capture_output=True, check=False, timeout=300)
    assert (done.returncode, done.stderr) == (0, b""), (done.returncode, done.stderr.decode())
    return done.stdout


def series(name, points, mark="circle", join="none", *dashed):
    return [("series", name, mark, join, *dashed), *(("point", *point) for point in points)]


class Drawn:
    """The elements of an SVG plot."""

    def __init__(self, *lines):
        self.root = ElementTree.fromstring(draw("svg", *lines))
        self.texts = [element for element in self.root.iter(SVG + "text") if "aria-hidden" not in element.attrib]
        self.words = [element.text for element in self.texts]

    def marks(self, color, shape="circle"):
        """Positions of the points' marks. They have tooltips; those of the legend have none."""
        return [(float(use.get("x")), float(use.get("y"))) for use in self.root.iter(SVG + "use")
                if use.get("fill") == color and use.get("href") == f"#plot-{shape}" and len(use)]

    def tooltips(self):
        return [title.text for use in self.root.iter(SVG + "use") for title in use]

    def lines(self, color):
        """Paths with the colour and the width of a series, as lists of positions."""
        paths = [path.get("d") for path in self.root.iter(SVG + "path")
                 if path.get("stroke") == color and path.get("stroke-width") == "2"]
        return [[[tuple(map(float, position.split(" "))) for position in line.split("L")] for line in path.split("M")[1:]]
                for path in paths]

    def tick(self, text, axis):
        """Position of the tick with the text, which is centred on the x axis and right-aligned on the y axis."""
        anchor = {"x": "middle", "y": "end"}[axis]
        (found,) = [element for element in self.texts if element.text == text and element.get("text-anchor") == anchor]
        # The base line of a y label lies 0.36 of the font's 13 pixels below its tick.
        return float(found.get("x")) if axis == "x" else float(found.get("y")) - 0.36 * 13


POINTS = [(0.05, 8), (0.3, 3.5), (1, 2), (7.5, 0.5), (20, 0.11)]
LOG_AXES = [("x", "time (s)", "log"), ("y", "error (levels)", "log")]


class Svg(unittest.TestCase):
    def test_has_size_title_and_description_for_screen_readers(self):
        drawn = Drawn(("title", "Cost"), ("size", 700, 500), *LOG_AXES, *series("measured", POINTS))
        self.assertEqual((drawn.root.tag, drawn.root.get("viewBox")), (SVG + "svg", "0 0 700 500"))
        self.assertEqual(drawn.root.get("role"), "img")
        labels = {element.get("id"): element.text for element in drawn.root if element.get("id")}
        self.assertEqual([labels[name] for name in drawn.root.get("aria-labelledby").split()],
                         ["Cost", "error (levels) over time (s). measured: 5 points, from (0.05, 8) to (20, 0.11)."])

    def test_contains_every_text_and_the_name_of_each_series(self):
        drawn = Drawn(("title", "Cost"), ("note", "For 1 level: 4 s."), *LOG_AXES, *series("one", POINTS),
                      *series("two", POINTS, "square"))
        for text in ("Cost", "For 1 level: 4 s.", "time (s)", "error (levels)", "one", "two"):
            self.assertEqual(drawn.words.count(text), 1, text)

    def test_positions_points_on_their_axes(self):
        for kind, points, ticks, of in (("log", POINTS, ("0.1", "10", "0.1", "1"), math.log10),
                                        ("linear", [(0, -1), (2.5, 0), (10, 4)], ("0", "10", "0", "4"), float)):
            drawn = Drawn(("x", "a", kind), ("y", "b", kind), *series("", points))
            left, right, low, high = (drawn.tick(text, axis) for text, axis in zip(ticks, "xxyy"))
            begin, end, bottom, top = (of(float(text)) for text in ticks)
            for (x, y), (across, down) in zip(points, drawn.marks(BLUE), strict=True):
                self.assertAlmostEqual(across, left + (right - left) * (of(x) - begin) / (end - begin), delta=0.02, msg=kind)
                self.assertAlmostEqual(down, low + (high - low) * (of(y) - bottom) / (top - bottom), delta=0.02, msg=kind)

    def test_joins_points_by_lines_steps_or_pairs(self):
        points = POINTS[:4]
        for join in ("line", "steps", "pairs"):
            drawn = Drawn(*LOG_AXES, *series("", points, "circle", join))
            a, b, c, d = drawn.marks(BLUE)
            held = [(after[0], before[1]) for before, after in ((a, b), (b, c), (c, d))]
            expected = {"line": [[a, b, c, d]], "steps": [[a, held[0], b, held[1], c, held[2], d]],
                        "pairs": [[a, b], [c, d]]}
            self.assertEqual(drawn.lines(BLUE), [expected[join]], join)
        self.assertEqual(Drawn(*LOG_AXES, *series("", points)).lines(BLUE), [])

    def test_pairs_stay_together_if_a_point_cannot_be_drawn(self):
        drawn = Drawn(*LOG_AXES, *series("", [POINTS[0], (1, 0), *POINTS[1:3]], "circle", "pairs"))
        _, b, c = drawn.marks(BLUE)
        self.assertEqual(drawn.lines(BLUE), [[[b, c]]])

    def test_series_have_different_colours_and_marks(self):
        drawn = Drawn(*LOG_AXES, *series("red", POINTS[:3], "circle", "none", "", "c00000"), *series("one", POINTS),
                      *series("two", POINTS[:2], "triangle", "line", "dashed"))
        self.assertEqual([len(drawn.marks(colour)) for colour in ("#c00000", BLUE)], [3, 5])
        self.assertEqual(len(drawn.marks(VERMILION, "triangle")), 2)
        dashed = [path for path in drawn.root.iter(SVG + "path") if path.get("stroke-dasharray")]
        self.assertTrue(dashed)
        self.assertEqual({path.get("stroke") for path in dashed}, {VERMILION})

    def test_tooltip_contains_label_and_values_of_the_point(self):
        drawn = Drawn(*LOG_AXES, *series("runs", [(0.25, 3, "draft"), (1, 2.00004)]))
        self.assertEqual(drawn.tooltips(), ["draft: 0.25, 3", "runs: 1, 2"])
        self.assertIn("draft", drawn.words)

    def test_omits_labels_without_space_but_not_their_points(self):
        crowd = [(1 + i / 1000, 1, f"point {i}") for i in range(50)]
        drawn = Drawn(("x", "", "linear"), ("y", "", "linear"), *series("", [(0, 0), *crowd]))
        shown = [word for word in drawn.words if word and word.startswith("point")]
        self.assertTrue(1 <= len(shown) <= 4, shown)
        self.assertEqual(len(drawn.marks(BLUE)), 51)

    def test_contains_the_number_of_omitted_points(self):
        lost = [(0, 1), (1, 0), ("nan", 1), (1, "inf"), (-1, 1), (1, "2e300")]
        drawn = Drawn(*LOG_AXES, *series("", [POINTS[0], *lost, POINTS[1]], "circle", "line"))
        self.assertIn("Not shown: 6 points that have no place on these axes.", drawn.words)
        self.assertEqual(drawn.lines(BLUE), [[drawn.marks(BLUE)]])
        self.assertEqual(len(drawn.marks(BLUE)), 2)
        self.assertFalse(any("Not shown" in word for word in Drawn(*LOG_AXES, *series("", POINTS)).words))

    def test_is_well_formed_with_any_text(self):
        hostile = b"<script>&amp;\"'--> ]]> \x01\x1b \xff\xc0\x80 \xed\xa0\x80 \xef\xbf\xbe"
        drawn = Drawn(("title", hostile), ("note", hostile), ("x", hostile, "log"), ("y", hostile, "log"),
                      *series(hostile, [(1, 1, hostile)]))
        self.assertEqual({element.tag.removeprefix(SVG) for element in drawn.root.iter()},
                         {"svg", "title", "desc", "defs", "circle", "path", "rect", "text", "use"})
        title = next(element.text for element in drawn.root if element.get("id") == "plot-title")
        self.assertEqual(title, "<script>&amp;\"'--> ]]> \ufffd\ufffd \ufffd\ufffd\ufffd \ufffd\ufffd\ufffd \ufffd")

    def test_refers_to_no_other_resource(self):
        text = draw("svg", *LOG_AXES, *series("", POINTS)).decode()
        self.assertEqual(set(re.findall(r'(?:href|src|url)[="(]+([^")]*)', text)), {"#plot-circle"})

    def test_has_axes_without_points(self):
        for kind, ticks in (("log", {"0.1", "1", "10"}), ("linear", {"0", "1"})):
            self.assertLessEqual(ticks, set(Drawn(("x", "", kind), ("y", "", kind)).words))

    def test_has_space_for_the_axes_below_a_legend_of_a_hundred_names(self):
        names = [f"series {i}" for i in range(100)]
        drawn = Drawn(("size", 320, 240), *LOG_AXES, *(line for name in names for line in series(name, [(1, 1)])))
        self.assertTrue(1 <= len([word for word in drawn.words if word in names]) < 100)
        top = min(float(text.get("y")) for text in drawn.texts if text.get("text-anchor") == "end")
        bottom = max(float(text.get("y")) for text in drawn.texts if text.get("text-anchor") == "end")
        self.assertGreater(bottom - top, 40)

    def test_shortens_texts_that_exceed_the_plot(self):
        long = "long " * 200
        drawn = Drawn(("size", 320, 240), ("title", long), ("note", long), ("x", long, "log"), ("y", long, "log"),
                      *series(long, POINTS))
        self.assertTrue(all(len(word) < 60 for word in drawn.words), drawn.words)
        self.assertEqual(len([word for word in drawn.words if word.endswith("…")]), 5)


class Png(unittest.TestCase):
    LINES = [("title", "Cost"), ("size", 700, 500), *LOG_AXES, *series("one", POINTS, "circle"),
             *series("two", [(0.1, 0.5), (1, 0.2)], "square", "line")]

    @classmethod
    def setUpClass(cls):
        cls.image = images.read_png(draw("png", *cls.LINES))
        cls.drawn = Drawn(*cls.LINES)

    def color_at(self, position):
        return "#%02x%02x%02x" % tuple(self.image[int(position[1]), int(position[0])])

    def test_has_the_size_of_the_plot_on_white(self):
        self.assertEqual(self.image.shape, (500, 700, 3))
        for corner in ((0, 0), (0, -1), (-1, 0), (-1, -1)):
            self.assertEqual(self.image[corner].tolist(), [255, 255, 255])

    def test_has_marks_and_lines_at_the_positions_of_the_svg(self):
        for position in self.drawn.marks(BLUE):
            self.assertEqual(self.color_at(position), BLUE)
        begin, end = self.drawn.marks(VERMILION, "square")
        for part in (0, 0.3, 0.5, 0.8, 1):
            self.assertEqual(self.color_at([a + part * (b - a) for a, b in zip(begin, end)]), VERMILION)

    def test_has_a_dark_title_of_the_expected_width(self):
        rows, columns = numpy.nonzero((self.image[:40] < 100).all(axis=-1))
        self.assertGreater(len(rows), 100)
        self.assertGreaterEqual(columns.min(), 17)
        self.assertTrue(40 < columns.max() - columns.min() < 80, columns.max())

    def test_is_written_with_any_text_and_without_points(self):
        hostile = b"<&> \xff \x01 \xed\xa0\x80"
        for lines in ([], [("title", hostile), ("x", hostile, "log"), *series(hostile, [(1, 1, hostile), ("nan", 0)])]):
            self.assertEqual(images.read_png(draw("png", *lines)).shape, (640, 960, 3))

    def test_size_is_at_least_320_x_240_and_at_most_8192_on_each_side(self):
        self.assertEqual(images.read_png(draw("png", ("size", 0, 1))).shape, (240, 320, 3))
        self.assertEqual(Drawn(("size", 4294967295, 300)).root.get("width"), "8192")

    def test_is_deterministic(self):
        for kind in ("png", "svg"):
            self.assertEqual(draw(kind, *self.LINES), draw(kind, *self.LINES))
