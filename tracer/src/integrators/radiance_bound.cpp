#include "tracer/src/integrators/radiance_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include "tracer/src/accel/primitive_bounds.h"
#include "tracer/src/accel/primitive_count.h"
#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();

/// Upper bound of the light that a surface point receives from all lights.
double light_bound(const CompiledScene& scene) {
  double sum = 0;
  for (const CompiledLight& light : scene.lights)
    sum += max_component(light.radiance) * attenuation_bound(light.attenuation);
  return sum;
}

double color_bound(const CompiledScene& scene, const ColorOrTexture& color) {
  if (const auto* id = std::get_if<TextureId>(&color))
    return texture_bound(scene.textures[id->index], scene.images[id->index].get());
  return max_component(std::get<Color>(color));
}

/// Upper bound of the fraction of light that secondary rays receive.
double albedo_bound(const CompiledScene& scene, const Material& material) {
  const bool diffuse = scene.needs.global_light;
  const double scattered =
      diffuse ? material.diffuse * color_bound(scene, material.color) +
                    material.diffuse_transmission * color_bound(scene, material.diffuse_transmission_color)
              : 0;
  const double reflected = material.reflection * color_bound(scene, material.reflection_color);
  const double transmitted = material.transmission * color_bound(scene, material.transmission_color);
  // Fresnel's reflectance and transmittance add up to one.
  return scattered + (material.fresnel ? std::max(reflected, transmitted) : reflected + transmitted);
}

double local_radiance_bound(const CompiledScene& scene, const Material& material, double lights) {
  const double color = color_bound(scene, material.color);
  const double diffuse = color * material.diffuse;
  const double specular = color_bound(scene, material.specular_color);
  // A light is on one side of the surface.
  const double reflected = diffuse + specular * material.specular;
  const double transmitted = color_bound(scene, material.diffuse_transmission_color) * material.diffuse_transmission +
                             specular * material.specular_transmission;
  const double lit = std::max(reflected, transmitted);
  return color_bound(scene, material.emission) + max_component(scene.ambient) * color * material.ambient +
         (lit > 0 && lights > 0 ? lights * lit : 0);
}

/// Points p with inward.p >= inward.point.
struct HalfSpace {
  Vec3 inward, point;
  /// False only if no point of the box is in the half space, up to rounding.
  [[nodiscard]] bool overlaps(const Bounds& box) const {
    const Vec3 corner{inward.x > 0 ? box.high.x : box.low.x, inward.y > 0 ? box.high.y : box.low.y,
                      inward.z > 0 ? box.high.z : box.low.z};
    return dot(inward, corner - point) >= -0x1p-40 * dot(abs(inward), abs(corner) + abs(point));
  }
};

/// The part of space that no path leaves, because opaque planes enclose it. A plane reflects to the side that light
/// comes from, unless a texture turns its normal. Everything under global light, where shadow rays find emitters.
std::vector<HalfSpace> reachable_region(const CompiledScene& scene) {
  std::vector<HalfSpace> region;
  const bool one_origin = scene.camera.eyes() == 1 && !scene.camera.has_parallel_rays() && !scene.needs.lens;
  if (!one_origin || scene.needs.global_light || scene.exact.needs.global_light) return region;
  const PlaneGeometry& planes = scene.geometry().planes;
  for (std::size_t i = 0; i < planes.point.size(); ++i) {
    const Material& material = scene.material_of(planes.object[i]);
    const Vec3 offset = scene.camera.position() - planes.point[i];
    const double height = dot(planes.normal[i], offset);
    const bool opaque = !lets_light_pass(material) && !material.normal_map && !material.bump;
    if (opaque && std::abs(height) > 1e-9 * length(offset))
      region.push_back({planes.normal[i] * height, planes.point[i]});
  }
  return region;
}

/// The largest of `bound` and the bounds `of_material` of the primitives that may be inside of the region.
double bound_inside(const CompiledScene& scene, const std::vector<HalfSpace>& region,
                    const std::vector<double>& of_material, double bound) {
  const GeometrySet& geometry = scene.geometry();
  for (PrimitiveRef primitive{0, 0}; primitive.geometry <= geometry.plane_geometry(); ++primitive.geometry) {
    const std::size_t count = primitive_count(geometry, primitive.geometry);
    for (primitive.primitive = 0; primitive.primitive < count; ++primitive.primitive) {
      const double light = of_material[scene.objects.material[geometry.object_of(primitive)]];
      if (light <= bound) continue;
      const Bounds box = bounds_of(geometry, primitive);
      const auto overlaps = [&](const HalfSpace& half) { return half.overlaps(box); };
      if (box.empty() || std::ranges::all_of(region, overlaps)) bound = light;
    }
  }
  return bound;
}

}  // namespace

std::optional<double> radiance_bound(const CompiledScene& scene) {
  const double lights = light_bound(scene);
  std::vector<double> of_material(scene.materials.size());
  double bound = scene.background->bound(), largest = bound;
  for (const std::uint32_t index : std::set(scene.objects.material.begin(), scene.objects.material.end())) {
    const Material& material = scene.materials[index];
    const double local = local_radiance_bound(scene, material, lights), albedo = albedo_bound(scene, material);
    of_material[index] = local > 0 && albedo < 1 ? local / (1 - albedo) : local > 0 || albedo > 1 ? unbounded : 0;
    largest = std::max(largest, of_material[index]);
  }
  const std::vector<HalfSpace> region = reachable_region(scene);
  bound = region.empty() ? largest : bound_inside(scene, region, of_material, bound);
  return std::isfinite(bound) ? std::optional(bound) : std::nullopt;
}

}  // namespace tracer
