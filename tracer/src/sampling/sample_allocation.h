#pragma once
/// Allocates the samples of the next round to pixels.

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/scene.h"
#include "tracer/src/sampling/pixel_state.h"

namespace tracer {

struct AllocationGoal {
  double squared_error = 0;  ///< target of the image, in squared code values over pixels and channels
  double cost = 0;           ///< expected limit, in the unit of the pixels' costs; may be infinite
  /// Open pixels with a larger bound are always refined, since their validation would need more samples. If this costs
  /// more than half of the limit, only those with the largest bounds are refined. The bounds of edges without contrast
  /// are multiplied, because their pilots may have missed a feature; such edges are few.
  double bound_max = std::numeric_limits<double>::infinity();
  std::uint32_t round = 0;  ///< the choice among pixels of equal demand differs between rounds
};

struct SampleAllocation {
  std::vector<std::uint32_t> half;  ///< samples in each half of a pixel after the round; 0: unchanged
  bool empty = true;                ///< no samples are to be traced
};

/// Samples of a pixel that is refined because of its bound: enough to find what covers a quarter of the pixel.
inline constexpr std::uint32_t refined_half = 2;

/// Allocates samples where they lower the error most for their cost and sets the pixels' roles. With a variance of one
/// sample v, its cost c and variances falling like n^-p (p as in pixel_state.h), the number of samples is proportional
/// to (v / c)^(1 / (1 + p)) (for p = 1 Neyman 1934; Cochran 1977, "Sampling Techniques", sec. 5.5). It is no larger
/// than the goal needs, within [samples_min, samples_max] of `limits`, a power of two in each half, which stratifies
/// best, and at most eight times the pixel's samples, from which its variance was estimated. `cost`: per sample of each
/// pixel.
SampleAllocation allocate_samples(std::span<PixelState> pixels, std::span<const float> cost, const AllocationGoal& goal,
                                  const Adaptive& limits);

/// A tile whose error shall become smaller by the factor `excess` > 1.
struct ExcessTile {
  PixelWindow window;  ///< in places: columns and rows of `pixels`
  double excess = 1;
};

/// Raises the samples of the pixels that cause the error of these tiles, within the same limits.
void raise_in_tiles(std::span<PixelState> pixels, std::uint32_t width, std::span<const ExcessTile> tiles,
                    const Adaptive& limits, SampleAllocation& allocation);

/// True if pixels that may have no more samples have most of the predicted error.
bool at_maximum(std::span<const PixelState> pixels, const Adaptive& limits);

/// True if an open pixel has a larger bound than `bound_max`.
bool any_unsafe(std::span<const PixelState> pixels, double bound_max);

/// Withdraws the allocations of pixels that got no samples: they are pilots again.
void withdraw_without_samples(std::span<PixelState> pixels);

}  // namespace tracer
