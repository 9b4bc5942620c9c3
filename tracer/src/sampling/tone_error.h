#pragma once
/// Error of an image by a statistic of the image: `overflow: scale` divides by the brightest channel, which is known
/// only from samples. If it is wrong, so is every pixel.

#include <cmath>
#include <numbers>
#include <span>

#include "tracer/scene.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// Range of the brightest channel of the converged image.
struct BrightestRange {
  double found = 0;  ///< brightest channel of the image
  double low = 0, high = 0;
  /// Standard deviations below the value of a pixel that is selected as the brightest one.
  double deviations_below = deviations;

  /// Adds a channel of a pixel: its value, the standard deviation of that, and how much its samples may have missed
  /// that is darker or brighter.
  void add(double value, double deviation, double darker, double brighter) {
    found = std::max(found, value);
    low = std::max(low, value - std::max(deviations_below * deviation, darker));
    high = std::max(high, value + std::max(deviations * deviation, brighter));
  }
  void add(const BrightestRange& part) {
    found = std::max(found, part.found);
    low = std::max(low, part.low);
    high = std::max(high, part.high);
  }

  static constexpr double deviations = 2.33;  ///< 99 % of a normal distribution
  /// The same for the largest of `count` values, by Bonferroni's inequality and the expansion of the normal tail
  /// (Abramowitz & Stegun 1964, 26.2.12): the largest is likely one that is too large.
  static double deviations_of_largest(double count) {
    const double log = std::log(count / 0.01);
    return std::max(deviations, std::sqrt(2 * log - std::log(4 * std::numbers::pi * log)));
  }
};

/// The larger of the sums of squared errors, in code values over pixels and channels, if an end of the range were the
/// brightest channel instead of the one that was found. 0 unless `output` divides by it.
double tone_error(std::span<const float> rgb, const Output& output, const BrightestRange& range,
                  const InParallel& in_parallel);

}  // namespace tracer
