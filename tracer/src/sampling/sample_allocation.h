#pragma once
/// Allocates the samples of the next round to pixels.

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

}  // namespace tracer
