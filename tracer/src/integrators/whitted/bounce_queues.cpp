#include "tracer/src/integrators/whitted/bounce_queues.h"

#include <limits>

namespace tracer {

std::pair<BounceQueues, BounceQueues> split(const BounceQueues& bounce) {
  std::uint32_t low = std::numeric_limits<std::uint32_t>::max(), high = 0;
  const auto include = [&](const RayQueue& queue) {
    for (std::size_t i = 0; i < queue.size(); ++i) {
      low = std::min(low, queue.sample(i));
      high = std::max(high, queue.sample(i));
    }
  };
  for (const RayQueue* queue : {&bounce.camera, &bounce.reflection, &bounce.refraction}) include(*queue);
  const std::uint32_t middle = low + (high - low) / 2;
  std::pair<BounceQueues, BounceQueues> halves;
  halves.first.depth = halves.second.depth = bounce.depth;
  std::size_t order = 0;
  const auto distribute = [&](RayQueue BounceQueues::*queue) {
    const RayQueue& from = bounce.*queue;
    for (std::size_t i = 0; i < from.size(); ++i, ++order) {
      const bool first = low == high ? order < bounce_rays_max : from.sample(i) <= middle;
      ((first ? halves.first : halves.second).*queue).push(from, i);
    }
  };
  for (const auto queue : {&BounceQueues::camera, &BounceQueues::reflection, &BounceQueues::refraction})
    distribute(queue);
  return halves;
}

}  // namespace tracer
