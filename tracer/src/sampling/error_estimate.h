#pragma once
/// Error estimate of an image, from the samples of each round.

#include <span>

#include "tracer/accuracy.h"
#include "tracer/src/sampling/pixel_state.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// Sum of squared errors in 8-bit code values over pixels and channels.
struct SampledError {
  double squared = 0;        ///< estimate; may be negative by chance
  double squared_upper = 0;  ///< upper bound at the stated confidence
};

/// Sum of squared errors and sum of their squares, from which the uncertainty follows.
struct SummedErrors {
  double squared = 0, spread = 0;
  void add(double squared_error) { add(SummedErrors{squared_error, squared_error * squared_error}); }
  void add(const SummedErrors& part) {
    squared += part.squared;
    spread += part.spread;
  }
  /// Estimate from samples that took part in the decision to stop.
  [[nodiscard]] SampledError estimated() const;
  /// Estimate from holdout samples.
  [[nodiscard]] SampledError validated() const;
};

SummedErrors summed(std::span<const float> squared_errors);

/// Estimates the error of the image and sets the predicted `variance` of every pixel. Pixels that have only their pilot
/// are represented by the holdout pixels among them; without any, by their predictions.
SampledError update_variances(std::span<PixelState> pixels, std::uint32_t width, const DisplayTransform& display,
                              const InParallel& in_parallel);

/// The greater of the estimates from the image's own samples and from holdout samples.
SampledError upper_bound(const SampledError& own, const SampledError& holdout);

/// Upper bound of the squared error by omitted radiance, in 8-bit code values, summed over the image.
struct OmittedError {
  double depth = 0, cutoff = 0, both = 0;
  /// Adds one channel of a pixel with this mean.
  void add(double mean, double omitted_depth, double omitted_cutoff, const DisplayTransform& display);
  void add(const OmittedError& part);
};

/// Root of the mean of sampling^2 + omitted^2 over `pixels`, at the stated confidence.
ErrorEstimate error_estimate(const SampledError& sampled, const OmittedError& omitted, std::size_t pixels);

/// Adds the error of approximations; `exact` is the whole error of the image against exact samples.
void add_approximation(ErrorEstimate& error, const SampledError& exact, std::size_t pixels);

}  // namespace tracer
