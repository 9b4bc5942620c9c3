#include "tracer/src/integrators/ray_queue.h"

namespace tracer {

void RayQueue::append(const Lanes& rays, LaneMask mask) {
  // Whole packets are written, whatever the mask.
  if (size_ + lanes > sample_.size()) grow(2 * size_ + lanes);
  const std::size_t end = size_;
  const Compressed eights[] = {
      {rays.ox, &ox_[end]}, {rays.oy, &oy_[end]}, {rays.oz, &oz_[end]}, {rays.dx, &dx_[end]}, {rays.dy, &dy_[end]},
      {rays.dz, &dz_[end]}, {rays.r, &r_[end]},   {rays.g, &g_[end]},   {rays.b, &b_[end]},   {rays.from, &from_[end]}};
  const Compressed fours[] = {{rays.sample, &sample_[end]}, {rays.media, &media_[end]}, {rays.path, &path_[end]}};
  compress_eights(eights, std::size(eights), mask);
  compress_fours(fours, rays.path != nullptr ? 3 : 2, mask);
  if (rays.path == nullptr) std::fill_n(&path_[end], lanes, 0u);
  size_ += static_cast<std::size_t>(std::popcount(mask));
}

}  // namespace tracer
