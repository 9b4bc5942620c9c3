#pragma once
/// Rays that are traced together, and what becomes of too many.

#include <cstdint>
#include <utility>

#include "tracer/src/integrators/ray_queue.h"

namespace tracer {

/// Rays of one depth, by kind.
struct BounceQueues {
  RayQueue camera, reflection, refraction;
  std::uint32_t depth = 0;  ///< 0: camera rays
  void clear() {
    for (RayQueue* queue : {&camera, &reflection, &refraction}) queue->clear();
  }
  [[nodiscard]] std::size_t size() const { return camera.size() + reflection.size() + refraction.size(); }
};

/// A generation larger than this is traced in parts, the first to its end before the second starts: memory then grows
/// with depth, not with the number of branches.
inline constexpr std::size_t bounce_rays_max = 16384;

/// Splits `whole` in two by samples; a single sample, by the order of its rays. Where a sample is cut depends on that
/// sample alone: one that shares its generation with others is first separated from them.
std::pair<BounceQueues, BounceQueues> split(const BounceQueues& whole);

}  // namespace tracer
