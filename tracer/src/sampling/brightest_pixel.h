#pragma once
/// Error of an image by a statistic of the image: `overflow: scale` divides by the brightest channel, which is known
/// only from samples. If it is wrong, so is every pixel.

#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <vector>

#include "tracer/scene.h"
#include "tracer/src/sampling/film.h"
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
/// brightest channel instead of the one that was found. Pixels above that have been brightened by chance. 0 unless
/// `output` divides by it.
double tone_error(std::span<const float> rgb, const Output& output, const BrightestRange& range,
                  const InParallel& in_parallel);

/// Samples of the pixels of an adaptive image that may be the brightest one.
class BrightestPixels {
 public:
  /// `features`: see PixelFeatures::brightest. `noisy`: a pilot shows its pixel only roughly, whatever is around it.
  /// References must outlive it.
  BrightestPixels(const Film& film, std::span<const float> features, bool noisy)
      : film_(film), features_(features), noisy_(noisy) {}

  static constexpr std::uint32_t steps_max = 10;

  /// Range of the brightest channel as far as it is known, after at most that many steps of samples.
  [[nodiscard]] BrightestRange range() const;
  /// The pixels that decide about the range, and the number of their next samples, an even number each: 16 at first,
  /// then twice as many as before. None if the range is within `tolerance` of the brightest channel, or none has less
  /// than `samples_max`.
  [[nodiscard]] std::vector<std::pair<std::size_t, std::uint32_t>> next(double tolerance,
                                                                        std::uint32_t samples_max) const;
  /// Adds samples of a pixel that are in the film, two independent halves.
  void add(std::size_t place, const SetSums& sums);

 private:
  struct Known {
    double count = 0, sets = 0, squared_deviation = 0;
    Color mean{};  ///< mean of these samples alone: those before have selected the pixel, and are too bright on average
  };
  struct Pixel {
    double value = 0, deviation = 0, high = 0;
  };
  [[nodiscard]] Pixel pixel(std::size_t place) const;
  /// The brightest that a feature may make the pixel, which too few samples have hit to show it; 0: there is none.
  [[nodiscard]] double missed(std::size_t place, double count) const {
    constexpr double reliable = 2;  // the share of the pixel that a feature covers is roughly known
    return features_.empty() || count >= feature_samples ? 0 : reliable * features_[place];
  }

  static constexpr std::uint32_t feature_samples = 128;
  const Film& film_;
  std::span<const float> features_;
  bool noisy_;
  std::map<std::size_t, Known> known_;  ///< by place
  double sum_ = 0, sets_ = 0;           ///< sum of the variances of one sample by the sets, and their number
};

}  // namespace tracer
