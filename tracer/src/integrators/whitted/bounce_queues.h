#pragma once
/// Ray queues of one bounce.

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

/// A larger bounce is split, and its first part traced to the end before the second: memory grows with the depth, not
/// with the number of rays.
inline constexpr std::size_t bounce_rays_max = 16384;

/// Splits a bounce by samples; one with a single sample, by the order of its rays. The position of that split depends
/// on the sample alone: samples that share a bounce are separated first.
std::pair<BounceQueues, BounceQueues> split(const BounceQueues& bounce);

}  // namespace tracer
