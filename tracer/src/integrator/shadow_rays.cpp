#include "tracer/src/integrator/shadow_rays.h"

#include <utility>

#include "tracer/src/math/rounding.h"

namespace tracer {

void ShadowRays::add_to(std::vector<Color>& radiance, Media& media, Coherence coherence) {
  if (rays_.empty()) return;
  blocked_.resize(rays_.size());
  scene_.accelerator->occluded(rays_.span(distance_.data()), blocked_.data(), coherence);
  const bool transmissive = needs_.transmissive_shadows;
  if (transmissive) cross_transmissive(media);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (blocked_[i] != 0) continue;
    radiance[rays_.sample(i)] += transmissive ? rays_.weight(i) * visible_[i] : rays_.weight(i);
  }
}

/// S_i of the rays that no opaque surface blocks: the product of K_t C_t over every surface on the way to the light,
/// and of the absorption between them, in the order they are crossed.
void ShadowRays::cross_transmissive(Media& media) {
  visible_.assign(rays_.size(), {1, 1, 1});
  crossing_.clear();
  crossing_distance_.clear();
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (blocked_[i] != 0) continue;
    crossing_.push(rays_.origin(i), rays_.direction(i), {}, static_cast<std::uint32_t>(i), rays_.from(i), 0,
                   rays_.media(i));
    crossing_distance_.push_back(distance_[i]);
  }
  for (std::uint64_t crossings = 0; !crossing_.empty(); ++crossings) {
    if (crossings > scene_.crossings_max || control_.cancelled()) break;
    scene_.accelerator->closest(crossing_.span(crossing_distance_.data()), crossed_.resized(crossing_.size()),
                                Coherence::coherent, Among::transmissive);
    next_.clear();
    next_distance_.clear();
    for (std::size_t i = 0; i < crossing_.size(); ++i) cross(i, crossed_.at(i), media);
    std::swap(crossing_, next_);
    std::swap(crossing_distance_, next_distance_);
  }
}

void ShadowRays::cross(std::size_t i, const Hit& hit, Media& media) {
  Color& visible = visible_[crossing_.sample(i)];
  const double length = hit.primitive.hit() ? hit.t : crossing_distance_[i];
  if (needs_.absorption) visible = visible * media.transmittance(crossing_.media(i), length);
  if (!hit.primitive.hit()) return;
  const Vec3 direction = crossing_.direction(i);
  const Surface surface = surface_at(scene_, hit, crossing_.origin(i), direction);
  const Material& material = scene_.materials[surface.material];
  const bool interpolated = material.transparency == Material::Transparency::interpolated;
  const Media::List before = crossing_.media(i);
  Media::List after = before;
  if (needs_.absorption || needs_.overlapping_media)
    after = surface.back ? media.leave(before, surface.object) : media.enter(before, surface.object);
  // What hides within a solid of higher priority is not there for shadows either.
  const bool hidden = after != before && media.filling(before) == media.filling(after);
  if (!hidden)
    visible = visible * (interpolated ? Color{1, 1, 1} : material.transmission_color) * material.transmission;
  const double left = crossing_distance_[i] - hit.t;
  if (is_black(visible) || !(left > 0)) return;
  next_.push(offset_origin(surface.point, surface.geometric_normal, direction), direction, {}, crossing_.sample(i),
             hit.primitive, 0, after);
  next_distance_.push_back(left);
}

}  // namespace tracer
