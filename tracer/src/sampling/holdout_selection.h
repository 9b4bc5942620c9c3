#pragma once
/// Selects the pixels of an image that holdout samples validate, and the number of their samples.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/sampling/pixel_state.h"

namespace tracer {

/// A randomly selected pixel.
struct HoldoutPixel {
  std::size_t place = 0;
  std::uint32_t half = 0;  ///< fresh samples in each of two halves
  double stands_for = 0;   ///< weight of its error: the number of pixels that it represents
};

struct HoldoutBudget {
  /// Expected number of selected pixels, if all pixels had only their pilot.
  double pixels = 0;
  /// Draws of refined pixels beside that. 256: enough for the stated confidence, however large the image is.
  std::uint32_t draws = 256;
};

/// Budget of an image with a target: one pixel in 32, and at least 2048, so that every pixel of a small image is
/// validated: its whole error may be in a single pixel.
HoldoutBudget full_holdout_budget(std::size_t pixels);
/// The same, reduced to a number of samples, but never to nothing.
HoldoutBudget holdout_budget_within(std::span<const PixelState> pixels, double samples_max);

/// Selects every pixel with a probability that spends equally many samples on each in the mean: pixels that cost much
/// have smaller errors and cost more to validate. This finds errors that were not predicted. For predicted errors,
/// refined pixels are also drawn in proportion to the predicted error (importance sampling: Cochran 1977, "Sampling
/// Techniques", sec. 9A), with one draw in each of as many equal strata. `stands_for` makes the sum unbiased for any
/// prediction.
///
/// Ascending, each pixel once. Deterministic in `stream` and `seed`.
std::vector<HoldoutPixel> select_holdout_pixels(std::span<const PixelState> pixels, const HoldoutBudget& budget,
                                                std::uint64_t stream, std::uint64_t seed);

/// Selects at most `count` of `pixels` without predictions, one in each of as many equal strata.
std::vector<HoldoutPixel> select_holdout_pixels(std::size_t pixels, std::size_t count, std::uint64_t stream,
                                                std::uint64_t seed);

}  // namespace tracer
