#pragma once
/// Wavefront, bump and normal maps: the normals that hits are shaded with, before anything is shaded.

#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/interaction/perturbed_normal.h"
#include "tracer/src/textures/height.h"

namespace tracer {

template <class Model>
void Wavefront<Model>::perturb_normals(const RayQueue& rays, ShadingPointPacket& shading_point) {
  for (int lane = 0; lane < hit_.count; ++lane) {
    if (!compiled_material_of_lane(lane).has_normal_map) continue;
    const Surface surface = surface_of_lane(shading_point, lane);
    const Material& material = scene_.materials[surface.material];
    const auto ray = static_cast<std::size_t>(hit_.ray[lane]);
    unperturbed_normal_[shading_point.hit[lane]] = surface.normal;
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
      const double scale = scene_.frame.render_from_world(material.bump->scale);
      outward = bumped_normal(outward, gradients, {slope.x * scale, slope.y * scale});
    }
    const Vec3 bent = surface.back ? -outward : outward;
    shading_point.normal_x[lane] = bent.x;
    shading_point.normal_y[lane] = bent.y;
    shading_point.normal_z[lane] = bent.z;
  }
}

}  // namespace tracer
