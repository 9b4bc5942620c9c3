#pragma once
/// Scenes of one shape, and the first hit of single rays.

#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/src/interaction/surface.h"

namespace tracer {

using scenes::compiled;

/// A shape with a checkered material, so that texture coordinates are computed.
inline Scene checkered(const Shape& shape, const std::optional<Transform>& transform = {}) {
  Scene scene = scenes::empty(1);
  Material material = scenes::matte({1, 1, 1});
  scene.textures.push_back({CheckerTexture{}, {1, 1}, {0, 0}, ""});
  material.color = TextureId{0};
  scenes::add(scene, shape, material);
  scene.objects[0].transform = transform;
  return scene;
}

/// First hit of a ray in render space.
struct Look {
  Hit hit;
  Surface surface;
  bool found = false;
};

inline Look look(const CompiledScene& scene, const Vec3& o, const Vec3& d, PrimitiveRef from = {}) {
  Look result;
  const RaySpan ray{&o.x, &o.y, &o.z, &d.x, &d.y, &d.z, nullptr, &from, 1};
  Hit& hit = result.hit;
  scene.accelerator->intersect(ray, {&hit.primitive, &hit.t, &hit.u, &hit.v}, Coherence::incoherent);
  result.found = hit.primitive.hit();
  if (result.found) result.surface = surface_at(scene, hit, o, d);
  return result;
}

/// Bound of the error of a point along a unit vector.
inline oracle::Real error_along(const Surface& surface, const oracle::Vec& n) {
  const Vec3& e = surface.point.error;
  return std::fabs(n.x) * e.x + std::fabs(n.y) * e.y + std::fabs(n.z) * e.z;
}

/// A direction on the outer side of a surface with about the normal n, half of the time along it; nothing where
/// rounding decides.
inline std::optional<Vec3> leaving(oracle::Random& random, const Surface& surface, const oracle::Vec& n) {
  const oracle::Vec away =
      random.chance(0.5) ? random.direction() : unit(random.across(n) + random.spread(1e-18, 1e-6) * n);
  const Vec3& face = surface.geometric_normal;
  const Vec3 direction = rounded(dot(away, oracle::Vec(face)) < 0 ? -away : away);
  return dot(direction, face) > 0 ? std::optional(direction) : std::nullopt;
}

}  // namespace tracer
