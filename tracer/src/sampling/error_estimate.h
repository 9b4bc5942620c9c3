#pragma once
/// Error estimate of an image, from the samples of each round.

#include <algorithm>
#include <limits>
#include <span>

#include "tracer/accuracy.h"
#include "tracer/src/sampling/pixel_state.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// Sum of squared errors in 8-bit code values over pixels and channels.
struct SampledError {
  double squared = 0;        ///< estimate; may be negative by chance
  double squared_upper = 0;  ///< upper bound at the stated confidence
  /// Adds an error that may be absent: its deviation is as large.
  void add_possible(double squared_error);
};

/// Sum of squared errors and sum of their squares, from which the uncertainty follows.
struct SummedErrors {
  double squared = 0, spread = 0, largest = 0;
  void add(double squared_error) { add(SummedErrors{squared_error, squared_error * squared_error, squared_error}); }
  void add(const SummedErrors& part) {
    squared += part.squared;
    spread += part.spread;
    largest = std::max(largest, part.largest);
  }
  /// Estimate from the samples of the image.
  [[nodiscard]] SampledError estimated() const;
};

SummedErrors summed(std::span<const float> squared_errors);

/// Error of a pilot, measured by one look.
struct LookError {
  std::uint32_t place = 0;
  double squared_error = 0;  ///< squared code values, summed over the channels; may be negative
};

/// Sum of squared errors that is estimated from some of them.
struct EstimatedSum {
  double squared = 0;   ///< may be negative by chance
  double variance = 0;  ///< variance of `squared`
  double unseen = 0;    ///< part of `squared` that further looks may exclude
};

/// Errors of refined edge pixels whose samples all agree: something in them may have been missed. Their number follows
/// from that of the pixels with a find:
///
/// - Next to a find each may contain a part of what was found. Of pixels with n samples that contain some of an edge,
///   about 1 / (n + 1) have missed it (Laplace's rule of succession). One more is added, for small numbers.
/// - Elsewhere they may contain small features like those that were found alone. If f1 of these were hit by one sample
///   and f2 by two, at least f1^2 / (2 f2) were hit by none (Chao 1984, "Nonparametric estimation of the number of
///   classes in a population"). One is added to f1 and f2, and one feature is suspected in any case. That one may have
///   any height within the interval of its pixel, the others are like those that were found.
///
/// A smooth surface with a wide interval may reflect or transmit anything. One of these pixels is suspected to have
/// missed a part, of any height within the interval (1 / 3 of its square in the mean).
struct SuspectedErrors {
  struct Pixels {
    double sum = 0;
    std::size_t count = 0;
    void add(const Pixels& part) {
      sum += part.sum;
      count += part.count;
    }
    /// Share of them that has missed something, if `number` have.
    [[nodiscard]] double share(double number) const {
      return count > 0 ? std::min(1.0, number / static_cast<double>(count)) : 0;
    }
    /// Their sum and, since the number is random (Poisson), its variance.
    [[nodiscard]] EstimatedSum estimate(double share) const {
      return {share * sum, count > 0 ? share * sum * sum / static_cast<double>(count) : 0};
    }
  };
  Pixels near_finds, elsewhere, on_surfaces;
  double missed_near_finds = 0;                    ///< sum of 1 / (n + 1)
  std::size_t found_by_one = 0, found_by_two = 0;  ///< alone
  double squared_shares = 0;                       ///< sum of missed_share()^2 over the pixels elsewhere
  SummedErrors squared_heights;                    ///< features that were found alone
  std::size_t found_alone = 0;

  void add(const SuspectedErrors& part) {
    near_finds.add(part.near_finds);
    elsewhere.add(part.elsewhere);
    on_surfaces.add(part.on_surfaces);
    missed_near_finds += part.missed_near_finds;
    found_by_one += part.found_by_one;
    found_by_two += part.found_by_two;
    squared_shares += part.squared_shares;
    squared_heights.add(part.squared_heights);
    found_alone += part.found_alone;
  }
  [[nodiscard]] double share_near_finds() const { return near_finds.share(missed_near_finds + 1); }
  /// Share of the pixels elsewhere that has missed a feature like those found.
  [[nodiscard]] double share_alike() const {
    const double ones = static_cast<double>(found_by_one) + 1, twos = static_cast<double>(found_by_two) + 1;
    return elsewhere.share(std::max(0.0, ones * ones / (2 * twos) - 1));
  }
  /// Error of such a pixel, if it is at most `error`. The largest height counts once more: a few do not show how much
  /// larger others are.
  [[nodiscard]] double error_alike(double error, double squared_share) const {
    if (found_alone == 0) return error;
    const double height = (squared_heights.squared + squared_heights.largest) / static_cast<double>(found_alone);
    return std::min(error, height * squared_share);
  }
  [[nodiscard]] EstimatedSum expected() const {
    const Pixels alike{error_alike(elsewhere.sum, squared_shares), elsewhere.count};
    EstimatedSum all;
    for (const EstimatedSum& part : {near_finds.estimate(share_near_finds()), elsewhere.estimate(elsewhere.share(1)),
                                     alike.estimate(share_alike()), on_surfaces.estimate(on_surfaces.share(1))}) {
      all.squared += part.squared;
      all.variance += part.variance;
    }
    return all;
  }
};

/// Sum of squared errors by the way in which they are known.
struct SampledParts {
  SummedErrors refined;   ///< estimated by their halves
  SummedErrors expected;  ///< the same, from the deviation of their samples
  double certified = 0;   ///< bounds of the errors of certified pixels
  double undetected = 0;  ///< errors of features that no sample has found yet
  SuspectedErrors suspected;
  double brightest = 0;  ///< channel of a sample, as far as the sums show it
  void add(const SampledParts& part) {
    brightest = std::max(brightest, part.brightest);
    refined.add(part.refined);
    expected.add(part.expected);
    certified += part.certified;
    undetected += part.undetected;
    suspected.add(part.suspected);
  }
  /// Expected error of certified pixels, at most. Samples in an interval of width w have a variance of at most w^2 / 4
  /// (Popoviciu 1935), which is the mean squared error of one of them; `certified` is the sum of w^2.
  [[nodiscard]] double certified_mean() const { return certified / 4; }
  [[nodiscard]] SampledError estimated(const EstimatedSum& looks) const;
};

/// Pixels of an image, row by row, and the bounds of their radiance if there are any. References must outlive it.
struct SampledPixels {
  std::span<PixelState> states;
  std::uint32_t width = 0;
  std::span<const RadianceInterval> bounds{};
};

/// Sums the errors of the pixels and sets the predicted `variance` of every pixel: from its contrast and its neighbors,
/// corrected by the mean over the pixels with similar predictions. Its own halves and look have no part in it, so that
/// they stay unbiased estimates whatever is decided by the predictions. `looks`: places may repeat.
SampledParts update_variances(const SampledPixels& pixels, const DisplayTransform& display,
                              std::span<const LookError> looks, const InParallel& in_parallel);

/// Upper bound of the squared error by omitted radiance, in 8-bit code values, summed over the image.
struct OmittedError {
  double depth = 0, cutoff = 0, both = 0;
  /// Adds one channel of a pixel with this mean.
  void add(double mean, double omitted_depth, double omitted_cutoff, const DisplayTransform& display);
  void add(const OmittedError& part);
};

/// Squared error of an image by cause, in squared code values over pixels and channels.
struct ErrorParts {
  SampledError sampled;
  OmittedError omitted;
  double tone = 0;  ///< see tone_error.h
  SampledError approximation{};
  double proven = std::numeric_limits<double>::infinity();  ///< bound of the sampled part
};

/// Squared errors in code values, summed over pixels and channels, and what the report needs beside the estimate.
struct KnownErrors {
  SampledError sampled;
  OmittedError omitted;
  double tone = 0;
  SampledError approximation{};
  double fixed = 0;                  ///< everything that samples cannot lower
  double unseen = 0, uncertain = 0;  ///< looks may lower them; `uncertain` is due to the variance of looks
  double proven = std::numeric_limits<double>::infinity();
  double worst_tile = 0;  ///< levels, without the fixed parts
  double first = 0;       ///< estimate before the first round, in levels
  double certified_share = 0;
  std::uint32_t rounds_before = 0;  ///< those before the approximations were measured
};

/// Roots of the means over `pixels` and channels, at the stated confidence.
ErrorEstimate error_estimate(const ErrorParts& parts, std::size_t pixels);

/// Adds the error of an approximation to an estimate of an image of `pixels` without one. Every tile is taken to have
/// it.
void add_approximation(ErrorEstimate& error, const SampledError& approximation, std::size_t pixels);

/// True if the estimates of the image and of its worst tile are within the targets that are set.
inline bool targets_reached(const ErrorEstimate& error) {
  return (!error.target || error.estimate <= *error.target) &&
         (!error.tile_target || error.worst_tile <= *error.tile_target);
}

}  // namespace tracer
