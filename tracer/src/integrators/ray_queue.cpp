#include "tracer/src/integrators/ray_queue.h"

#include <limits>

namespace tracer {

void RayQueue::append(const Lanes& rays, LaneMask mask) {
  // Whole packets are written, whatever the mask.
  if (size_ + lanes > sample_.size()) grow(2 * size_ + lanes);
  const std::size_t end = size_;
  const auto& [origin, direction, throughput, sample, from, path, media] = rays;
  const bool colored = throughput != nullptr;
  const Compressed eights[] = {{origin.x, &ox_[end]},
                               {origin.y, &oy_[end]},
                               {origin.z, &oz_[end]},
                               {direction.x, &dx_[end]},
                               {direction.y, &dy_[end]},
                               {direction.z, &dz_[end]},
                               {from, &from_[end]},
                               {colored ? throughput->r : nullptr, &r_[end]},
                               {colored ? throughput->g : nullptr, &g_[end]},
                               {colored ? throughput->b : nullptr, &b_[end]}};
  const Compressed fours[] = {{sample, &sample_[end]}, {media, &media_[end]}, {path, &path_[end]}};
  compress_eights(eights, colored ? 10 : 7, mask);
  compress_fours(fours, path != nullptr ? 3 : 2, mask);
  if (path == nullptr) std::fill_n(&path_[end], lanes, 0u);
  size_ += static_cast<std::size_t>(std::popcount(mask));
}

std::pair<BounceQueuesPtr, BounceQueuesPtr> split(const BounceQueues& bounce) {
  std::uint32_t low = std::numeric_limits<std::uint32_t>::max(), high = 0;
  const auto include = [&](const RayQueue& queue) {
    for (std::size_t i = 0; i < queue.size(); ++i) {
      low = std::min(low, queue.sample(i));
      high = std::max(high, queue.sample(i));
    }
  };
  for (const RayQueue* queue :
       {&bounce.camera, &bounce.reflection, &bounce.refraction, &bounce.diffuse, &bounce.emission})
    include(*queue);
  const std::uint32_t middle = low + (high - low) / 2;
  std::pair halves{std::make_unique<BounceQueues>(), std::make_unique<BounceQueues>()};
  halves.first->depth = halves.second->depth = bounce.depth;
  std::size_t order = 0;
  const auto distribute = [&](RayQueue BounceQueues::*queue) {
    const RayQueue& from = bounce.*queue;
    for (std::size_t i = 0; i < from.size(); ++i, ++order) {
      const bool first = low == high ? order < bounce_rays_max : from.sample(i) <= middle;
      ((first ? *halves.first : *halves.second).*queue).push(from, i);
    }
  };
  for (const auto queue : {&BounceQueues::camera, &BounceQueues::reflection, &BounceQueues::refraction,
                           &BounceQueues::diffuse, &BounceQueues::emission})
    distribute(queue);
  return halves;
}

}  // namespace tracer
