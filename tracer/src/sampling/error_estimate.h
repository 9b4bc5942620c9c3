#pragma once
/// Error estimate of an image by its parts.

#include <algorithm>
#include <span>

#include "tracer/accuracy.h"
#include "tracer/src/display/display_transform.h"

namespace tracer {

/// One-sided 95 % of a normal distribution is 1.645 deviations. The true error is a random sum of squares like its
/// estimate and independent of it, which makes that 2.33 deviations of the estimate.
inline constexpr double error_deviations = 2.33;

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

/// Squared error by rays that limits of the document ended, in 8-bit code values, summed over the image.
struct OmittedError {
  double depth = 0, cutoff = 0, both = 0;
};

/// Squared error of an image by cause, in squared code values over pixels and channels.
struct ErrorParts {
  SampledError sampled;
  OmittedError omitted;
  double tone = 0;  ///< see brightest_pixel.h
  SampledError approximation{};
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
