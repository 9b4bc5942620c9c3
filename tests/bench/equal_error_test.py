"""Costs at equal true error from measured points, and the measurement of errors. No program is run."""
import pathlib
import tempfile
import unittest

import numpy

from tests.bench.peers import ppm
from tests.bench.peers.equal_error import Point, Ratio, cost_at, frontier, geometric_mean, ratio_at
from tests.bench.peers.sweeps import sweep, true_error


def points(*pairs):
    """Points of (error, CPU seconds); the wall time is twice that."""
    return [Point(f"{error:g}", error, cpu_s, 2 * cpu_s) for error, cpu_s in pairs]


class Frontier(unittest.TestCase):
    def test_omits_points_that_another_beats_in_cost_and_error(self):
        found = frontier(points((1, 5), (4, 1), (3, 6), (2, 2), (2, 3)), "cpu_s")
        self.assertEqual([(point.error, point.cpu_s) for point in found], [(4, 1), (2, 2), (1, 5)])

    def test_omits_costs_below_that_of_few_pixels(self):
        self.assertEqual(frontier(points((4, -1), (3, 0), (2, 2)), "cpu_s"), points((2, 2)))


class CostAtEqualError(unittest.TestCase):
    def test_of_a_power_law_is_exact(self):
        law = points(*((error, 3 * error ** -1.5) for error in (9, 5, 1.7, 0.3)))
        for target in (8, 3, 1, 0.4):
            self.assertAlmostEqual(cost_at(law, target, "cpu_s").value, 3 * target ** -1.5)
            self.assertAlmostEqual(cost_at(law, target, "wall_s").value, 6 * target ** -1.5)

    def test_of_a_measured_error_is_its_cost(self):
        self.assertEqual(cost_at(points((4, 1), (2, 2), (1, 8)), 2, "cpu_s"), (2, "2"))

    def test_is_the_time_of_the_cheapest_setting_that_reaches_it(self):
        self.assertEqual(cost_at(points((4, 1), (1, 50), (0.9, 6), (0.5, 7)), 1, "cpu_s").setting, "0.9")

    def test_is_not_extrapolated_to_smaller_errors(self):
        self.assertIsNone(cost_at(points((4, 1), (2, 2)), 1.99, "cpu_s"))
        self.assertIsNone(cost_at([], 1, "cpu_s"))

    def test_is_that_of_the_cheapest_setting_for_larger_errors(self):
        self.assertEqual(cost_at(points((4, 1), (2, 2)), 8, "cpu_s"), (1, "4"))

    def test_of_an_error_below_the_resolution_is_not_interpolated(self):
        self.assertEqual(cost_at(points((4, 1), (0, 2)), 1, "cpu_s"), (2, "0"))


class RatioAtEqualError(unittest.TestCase):
    ours = points((4, 1), (1, 2))

    def test_is_theirs_to_ours(self):
        ratio = ratio_at(points((8, 1), (1, 20)), self.ours, 1, "cpu_s")
        self.assertTrue(ratio.exact)
        self.assertAlmostEqual(ratio.value, 10)

    def test_is_that_of_the_dearest_setting_where_they_never_reach_the_error(self):
        self.assertEqual(ratio_at(points((4, 1), (3, 6), (2, 5)), self.ours, 1, "cpu_s"), (3, False))

    def test_is_unknown_where_we_never_reach_the_error(self):
        self.assertIsNone(ratio_at(points((0.1, 1)), self.ours, 0.5, "cpu_s"))

    def test_is_unknown_where_their_costs_are_too_short_to_measure(self):
        self.assertIsNone(ratio_at(points((4, -1), (0.5, 0)), self.ours, 1, "cpu_s"))

    def test_has_a_geometric_mean_over_the_exact_ones(self):
        self.assertAlmostEqual(geometric_mean([Ratio(2, True), None, Ratio(8, True), Ratio(100, False)]), 4)
        self.assertIsNone(geometric_mean([None, Ratio(2, False)]))


class Sweep(unittest.TestCase):
    def run_settings(self, curves, **limits):
        """The settings that are run, of curves of (error, cost)."""
        return [(point.error, point.cpu_s) for point in sweep(curves, lambda pair: points(pair)[0], 1, **limits)]

    def test_ends_a_curve_at_the_smallest_error(self):
        self.assertEqual(self.run_settings([[(3, 1), (0.9, 2), (0.5, 3)]]), [(3, 1), (0.9, 2)])

    def test_ends_a_curve_that_costs_more_than_another_that_reaches_the_smallest_error(self):
        self.assertEqual(self.run_settings([[(1, 2)], [(3, 1), (2, 2), (1, 3)], [(4, 1), (0.9, 1.5)]]),
                         [(1, 2), (3, 1), (2, 2), (4, 1), (0.9, 1.5)])


    def test_ends_a_curve_at_the_largest_cost(self):
        self.assertEqual(self.run_settings([[(4, 1), (3, 5), (2, 6)]], most_cpu_s=5), [(4, 1), (3, 5)])


class TrueError(unittest.TestCase):
    def test_does_not_contain_the_noise_of_independent_references(self):
        random = numpy.random.default_rng(1)
        truth, image_noise, a, b = (random.normal(size=(200, 200, 3)) for _ in range(4))
        self.assertAlmostEqual(true_error(truth + 2 * image_noise, (truth + a, truth + b)), 2, delta=0.02)

    def test_is_zero_below_the_resolution_of_the_references(self):
        one = numpy.ones((2, 2, 3))
        self.assertEqual(true_error(one, (0 * one, 2 * one)), 0)


class EnlargedImage(unittest.TestCase):
    def test_is_averaged_by_blocks_of_linear_values(self):
        codes = numpy.arange(4 * 6 * 3, dtype=">u2").reshape(4, 6, 3)
        with tempfile.TemporaryDirectory() as directory:
            path = pathlib.Path(directory) / "a.ppm"
            path.write_bytes(b"P6\n6 4\n65535\n" + codes.tobytes())
            image = ppm.read(path, 2)
        self.assertEqual(image.shape, (2, 3, 3))
        self.assertAlmostEqual(image[1, 2, 1], codes[2:, 4:, 1].mean() / 65535)

    def test_is_encoded_with_the_curve_of_srgb(self):
        codes = ppm.encode_srgb(numpy.array([0, 0.0031308, 0.2140411, 1]))
        numpy.testing.assert_allclose(codes, [0, 0.04045, 0.5, 1], atol=1e-6)


if __name__ == "__main__":
    unittest.main()
