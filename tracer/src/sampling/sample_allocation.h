#pragma once
/// Allocates the samples of the next round to pixels, and selects the pixels that holdout samples validate.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/src/sampling/pixel_state.h"

namespace tracer {

struct AllocationGoal {
  double squared_error = 0;  ///< target of the image, in squared code values over pixels and channels
  double cost = 0;           ///< limit, in the unit of the pixels' costs; may be infinite
};

struct SampleAllocation {
  std::vector<std::uint32_t> half;  ///< samples in each half of a pixel after the round; 0: unchanged
  bool empty = true;                ///< no samples are to be traced
};

/// Allocates samples where they lower the error most for their cost and sets the pixels' roles. With a variance of one
/// sample v, its cost c and variances falling like n^-p, the number of samples is proportional to (v / c)^(1 / (1 + p))
/// (for p = 1 Neyman 1934; Cochran 1977, "Sampling Techniques", sec. 5.5). It is no larger than the goal needs, within
/// [samples_min, samples_max] of `limits`, a power of two in each half, which stratifies best, and at most eight times
/// the pixel's samples, from which its variance was estimated. `cost`: per sample of each pixel. Deterministic in
/// `round` and `seed`.
SampleAllocation allocate_samples(std::span<PixelState> pixels, std::span<const float> cost, const AllocationGoal& goal,
                                  const Adaptive& limits, std::uint32_t round, std::uint64_t seed);

/// A randomly selected pixel that holdout samples validate.
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
