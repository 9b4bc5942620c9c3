#pragma once
/// Which pixels get samples in the next round, and how many.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/src/accuracy/pixel_state.h"

namespace tracer {

/// What a round is to reach, and what it may cost.
struct RoundGoal {
  double squared_error = 0;  ///< of the picture, in squared levels over pixels and channels
  double cost = 0;           ///< in the unit of the pixels' costs; infinite: any
};

/// Samples for each pixel, in each of the two halves, and the pixel's role. Beside the pixels.
struct RoundPlan {
  std::vector<std::uint32_t> half;
  std::uint64_t samples = 0;  ///< all together
};

/// Samples that lower the error most for their cost: their number in proportion to sqrt(variance of one / cost of one)
/// (Neyman 1934; Cochran 1977, "Sampling Techniques", sec. 5.5), no more than reaches the goal, within
/// [samples_min, samples_max] of `limits`, and at most eight times what a pixel had, since its variance was learned
/// from those. Sets the pixels' roles. `cost`: of one sample, beside the pixels. Deterministic in `round` and `seed`.
RoundPlan plan_round(std::span<PixelState> pixels, std::span<const float> cost, const RoundGoal& goal,
                     const Adaptive& limits, std::uint32_t round, std::uint64_t seed);

}  // namespace tracer
