#include "tracer/src/compile/render_shadow_maps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/integrators/hits.h"
#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/lights/registry.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

constexpr std::uint32_t side_max = 1024;  ///< 4 MiB a face: finer than the pixels of most images
constexpr double texels_max = 0x1p25;     ///< of all lights together: 128 MiB

/// A ball around everything finite, trace frame.
struct BoundingSphere {
  Vec3 center;
  double radius = 0;
};

BoundingSphere ball_around(const Bounds& finite, const RenderSpace& frame) {
  const Vec3 low = frame.render_from_world(finite.low), high = frame.render_from_world(finite.high);
  // The bounds are of what was rounded on its way into the trace frame.
  return {(low + high) * 0.5, length(high - low) * 0.5 * (1 + 0x1p-20)};
}

/// Texels along a face of a light with so many. A map has four times the pixels of the image: at four samples a pixel
/// it costs what it saves. (Of the whole image, so that a crop is a part of it.)
std::uint32_t side_of(const CompiledScene& scene, std::size_t faces) {
  const double pixels = static_cast<double>(scene.image.width) * scene.image.height;
  const double texels = std::min(4 * pixels, texels_max / static_cast<double>(scene.lights.size()));
  const double side = std::sqrt(texels / static_cast<double>(faces));
  return static_cast<std::uint32_t>(std::clamp(side, 1.0, double{side_max}));
}

ShadowFace parallel_face(const Vec3& forward, const BoundingSphere& ball) {
  ShadowFace face;
  face.origin = ball.center;
  face.axes = axes_across(forward, {1, 0, 0});
  face.parallel = true;
  face.reach = ball.radius;
  return face;
}

/// From outside a window that holds the ball is enough: back_face it, beside the ball, nothing finite is in the way.
ShadowFace face_towards(const Vec3& light, const BoundingSphere& ball) {
  const Vec3 offset = ball.center - light;
  const double distance = length(offset);
  const Vec3 forward = offset / distance;
  // So far away that its rays part by less than any texel.
  if (distance > 0x1p20 * ball.radius) return parallel_face(forward, ball);
  ShadowFace face;
  face.origin = light;
  face.axes = axes_across(forward, {1, 0, 0});
  face.reach = ball.radius / std::sqrt((distance - ball.radius) * (distance + ball.radius));
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

std::vector<ShadowFace> faces_of(const CompiledLight& light, const BoundingSphere& ball) {
  if (!(ball.radius > 0) || !light.shadows) return {};
  if (light.kind == light_kind<DirectionalLight>) return {parallel_face(-light.axis, ball)};
  const Vec3 middle = light_center(light);
  // At one and a half radii the window is 84 degrees wide; much nearer, six of 90 see more sharply.
  if (length(ball.center - middle) > 1.5 * ball.radius + light.radius) return {face_towards(middle, ball)};
  return cube_around(middle);
}

/// Traces one row. Rays begin before the ball. From within it, on the surface of a light that is a sphere, so that a
/// lamp inside is no obstacle, and of others a millionth of the ball away: nor is what they sit on.
void trace_row(const CompiledScene& scene, const CompiledLight& light, const BoundingSphere& ball, std::uint32_t row,
               ShadowFace& face) {
  RayQueue rays;
  std::vector<double> start(face.side), step(face.side);
  for (std::uint32_t column = 0; column < face.side; ++column) {
    const ShadowFace::Ray ray = face.ray(column, row);
    step[column] = length(ray.step);
    const bool inside = !face.parallel && face.base == 0;
    start[column] = inside ? std::max(light.radius, ball.radius * 0x1p-20) / step[column] : face.base - ball.radius;
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

std::vector<ShadowMap> trace_shadow_maps(const CompiledScene& scene, const Bounds& finite,
                                         const RenderControl& control) {
  const BoundingSphere ball = ball_around(finite, scene.frame);
  std::vector<ShadowMap> maps;
  for (const CompiledLight& light : scene.lights) {
    ShadowMap& map = maps.emplace_back();
    map.faces = faces_of(light, ball);
    for (ShadowFace& face : map.faces) {
      face.side = side_of(scene, map.faces.size());
      face.depth.resize(std::size_t{face.side} * face.side);
      for_each_tile(face.side, 0, [&](std::uint64_t row) {
        if (!control.cancelled()) trace_row(scene, light, ball, static_cast<std::uint32_t>(row), face);
      });
    }
  }
  return maps;
}

}  // namespace tracer
