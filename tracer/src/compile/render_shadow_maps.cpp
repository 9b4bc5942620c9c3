#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/lights/light_registry.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

constexpr std::uint32_t side_max = 1024;  ///< 4 MiB a face: finer than the pixels of most images
constexpr double texels_max = 0x1p25;     ///< over all lights: 128 MiB

/// Bounding sphere of all finite shapes, render space.
struct BoundingSphere {
  Vec3 center;
  double radius = 0;
};

BoundingSphere bounding_sphere(const Bounds& finite, const RenderSpace& frame) {
  const Vec3 low = frame.render_from_world(finite.low), high = frame.render_from_world(finite.high);
  // The shapes are rounded when they are converted to render space.
  return {(low + high) * 0.5, length(high - low) * 0.5 * (1 + 0x1p-20)};
}

/// Texels along the side of a face. A map has four times the pixels of the whole image (a crop must not change it): at
/// four samples per pixel its cost equals the cost of the shadow rays that it replaces.
std::uint32_t side_of(const CompiledScene& scene, std::size_t faces) {
  const double pixels = static_cast<double>(scene.image.width) * scene.image.height;
  const double texels = std::min(4 * pixels, texels_max / static_cast<double>(scene.lights.size()));
  const double side = std::sqrt(texels / static_cast<double>(faces));
  return static_cast<std::uint32_t>(std::clamp(side, 1.0, double{side_max}));
}

ShadowFace parallel_face(const Vec3& forward, const BoundingSphere& sphere) {
  ShadowFace face;
  face.origin = sphere.center;
  face.axes = axes_across(forward, {1, 0, 0});
  face.parallel = true;
  face.reach = sphere.radius;
  return face;
}

/// From outside, one face that covers the bounding sphere suffices: no finite shape lies outside of the sphere.
ShadowFace face_towards(const Vec3& light, const BoundingSphere& sphere) {
  const Vec3 offset = sphere.center - light;
  const double distance = length(offset);
  const Vec3 forward = offset / distance;
  // At this distance the rays diverge by less than a texel.
  if (distance > 0x1p20 * sphere.radius) return parallel_face(forward, sphere);
  ShadowFace face;
  face.origin = light;
  face.axes = axes_across(forward, {1, 0, 0});
  face.reach = sphere.radius / std::sqrt((distance - sphere.radius) * (distance + sphere.radius));
  face.base = distance;
  return face;
}

std::vector<ShadowFace> cube_around(const Vec3& light) {
  std::vector<ShadowFace> faces;
  for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}})
    for (const double sign : {1.0, -1.0}) {
      ShadowFace& face = faces.emplace_back();
      face.origin = light;
      face.axes = axes_across(axis * sign, {1, 0, 0});
    }
  return faces;
}

std::vector<ShadowFace> faces_of(const CompiledLight& light, const BoundingSphere& sphere) {
  if (!(sphere.radius > 0) || !light.shadows) return {};
  if (light.kind == light_kind<DirectionalLight>) return {parallel_face(-light.axis, sphere)};
  const Vec3 center = light_center(light);
  // At 1.5 radii the face is 84 degrees wide; closer, six faces of 90 degrees have a higher resolution.
  if (length(sphere.center - center) > 1.5 * sphere.radius + light.radius) return {face_towards(center, sphere)};
  return cube_around(center);
}

/// Renders one row. Rays start in front of the bounding sphere. If the light is inside of it, they start on the surface
/// of a sphere light, so that a lamp model inside does not occlude it, and otherwise a millionth of the radius away, so
/// that the surface which holds the light does not.
void render_row(const CompiledScene& scene, const CompiledLight& light, const BoundingSphere& sphere, std::uint32_t row,
                ShadowFace& face) {
  RayQueue rays;
  std::vector<double> start(face.side), step(face.side);
  for (std::uint32_t column = 0; column < face.side; ++column) {
    const ShadowFace::Ray ray = face.ray(column, row);
    step[column] = length(ray.step);
    const bool inside = !face.parallel && face.base == 0;
    start[column] = inside ? std::max(light.radius, sphere.radius * 0x1p-20) / step[column] : face.base - sphere.radius;
    rays.push(ray.origin + ray.step * start[column], ray.step / step[column], {}, column, {}, 0, 0);
  }
  Hits hits;
  scene.accelerator->intersect(rays.span(), hits.resize_to_fit(rays.size()), Coherence::coherent, GeometryMask::opaque);
  for (std::uint32_t column = 0; column < face.side; ++column) {
    const double depth = start[column] + hits.t[column] / step[column] - face.base;
    face.depth[std::size_t{row} * face.side + column] =
        hits.primitive[column].hit() ? static_cast<float>(depth) : std::numeric_limits<float>::infinity();
  }
}

}  // namespace

std::vector<ShadowMap> render_shadow_maps(const CompiledScene& scene, const Bounds& finite,
                                          const RenderControl& control) {
  const BoundingSphere sphere = bounding_sphere(finite, scene.frame);
  std::vector<ShadowMap> maps;
  for (const CompiledLight& light : scene.lights) {
    ShadowMap& map = maps.emplace_back();
    map.faces = faces_of(light, sphere);
    for (ShadowFace& face : map.faces) {
      face.side = side_of(scene, map.faces.size());
      face.depth.resize(std::size_t{face.side} * face.side);
      for_each_tile(face.side, 0, [&](std::uint64_t row) {
        if (!control.cancelled()) render_row(scene, light, sphere, static_cast<std::uint32_t>(row), face);
      });
    }
  }
  return maps;
}

}  // namespace tracer
