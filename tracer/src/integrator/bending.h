#pragma once
/// Wavefront, bump and normal maps: the normals that hits are shaded with, before anything is shaded.

#include "tracer/src/integrator/wavefront.h"
#include "tracer/src/shapes/bent_normal.h"
#include "tracer/src/textures/height.h"

namespace tracer {

template <class Model>
void Wavefront<Model>::bend_normals(const RayQueue& rays) {
  unbent_.clear();
  for (std::size_t hit = 0; hit < hit_ray_.size(); ++hit) {
    Surface& surface = surface_[hit];
    const Material& material = scene_.materials[surface.material];
    if (!material.bump && !material.normal_map) {
      unbent_.emplace_back();
      continue;
    }
    unbent_.push_back(surface.normal);
    const UvGradients gradients = uv_gradients_at(scene_, hits_.at(hit_ray_[hit]), surface);
    // Textures bend the front; the back is its other side.
    Vec3 outward = surface.back ? -surface.normal : surface.normal;
    if (material.normal_map) {
      const auto [texture, image] = texture_of(*material.normal_map);
      const Color color = texture_color(texture, surface.uv, covered_of(rays, hit, texture), image);
      outward = mapped_normal(outward, gradients, tangent_normal(color));
    }
    if (material.bump) {
      const auto [texture, image] = texture_of(material.bump->texture);
      const Vec2 slope = height_slope(texture, surface.uv, covered_of(rays, hit, texture), image);
      const double scale = scene_.frame.trace_from_world(material.bump->scale);
      outward = bumped_normal(outward, gradients, {slope.x * scale, slope.y * scale});
    }
    surface.normal = surface.back ? -outward : outward;
  }
}

}  // namespace tracer
