#pragma once
/// Wavefront, bump and normal maps: the normals that hits are shaded with, before anything is shaded.

#include "tracer/src/integrator/wavefront.h"
#include "tracer/src/shapes/bent_normal.h"
#include "tracer/src/textures/height.h"

namespace tracer {

template <class Model>
void Wavefront<Model>::bend_normals(const RayQueue& rays, FacingPacket& facing) {
  for (int lane = 0; lane < hit_.count; ++lane) {
    if (!terms_of_lane(lane).bends) continue;
    const Surface surface = surface_of_lane(facing, lane);
    const Material& material = scene_.materials[surface.material];
    const auto ray = static_cast<std::size_t>(hit_.ray[lane]);
    unbent_[facing.hit[lane]] = surface.normal;
    const UvGradients gradients = uv_gradients_at(scene_, hits_.at(ray), surface);
    // Textures bend the front; the back is its other side.
    Vec3 outward = surface.back ? -surface.normal : surface.normal;
    if (material.normal_map) {
      const auto [texture, image] = texture_of(*material.normal_map);
      const Color color = texture_color(texture, surface.uv, covered_of(rays, ray, surface, texture), image);
      outward = mapped_normal(outward, gradients, tangent_normal(color));
    }
    if (material.bump) {
      const auto [texture, image] = texture_of(material.bump->texture);
      const Vec2 slope = height_slope(texture, surface.uv, covered_of(rays, ray, surface, texture), image);
      const double scale = scene_.frame.trace_from_world(material.bump->scale);
      outward = bumped_normal(outward, gradients, {slope.x * scale, slope.y * scale});
    }
    const Vec3 bent = surface.back ? -outward : outward;
    facing.normal_x[lane] = bent.x;
    facing.normal_y[lane] = bent.y;
    facing.normal_z[lane] = bent.z;
  }
}

}  // namespace tracer
