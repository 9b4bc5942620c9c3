#pragma once
/// Which pixels get samples in the next round, and how many.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/src/sampling/pixel_state.h"

namespace tracer {

/// What a round is to reach, and what it may cost.
struct AllocationGoal {
  double squared_error = 0;  ///< of the image, in squared levels over pixels and channels
  double cost = 0;           ///< in the unit of the pixels' costs; infinite: any
};

/// How many samples each half of a pixel is to have when the round is over; 0: the pixel is left alone.
struct SampleAllocation {
  std::vector<std::uint32_t> half;  ///< beside the pixels
  bool empty = true;                ///< nothing is to be traced
};

/// Samples that lower the error most for their cost: with a variance of one sample v, its cost c and variances falling
/// like n^-p, their number in proportion to (v / c)^(1 / (1 + p)) (for p = 1 Neyman 1934; Cochran 1977, "Sampling
/// Techniques", sec. 5.5); no more than reaches the goal, within [samples_min, samples_max] of `limits`, a power of two
/// in each half, since these are stratified best, and at most eight times what a pixel had, since its variance was
/// learned from those. Sets the pixels' roles. `cost`: of one sample, beside the pixels. Deterministic in `round` and
/// `seed`.
SampleAllocation plan_round(std::span<PixelState> pixels, std::span<const float> cost, const AllocationGoal& goal,
                            const Adaptive& limits, std::uint32_t round, std::uint64_t seed);

}  // namespace tracer
