#pragma once
/// From a shape to the surface that a ray finds there, through compile and the accelerator.

#include <gtest/gtest.h>

#include "tests/support/long_vec.h"
#include "tests/support/scenes.h"
#include "tracer/src/shapes/surface.h"

namespace tracer {

inline std::shared_ptr<const CompiledScene> compiled(const Scene& scene) {
  RenderControl control;
  auto result = compile(scene, control);
  EXPECT_TRUE(result.has_value());
  return *result;
}

/// The scene's first hit of a ray given in the trace frame; `found` false: none.
struct Look {
  Hit hit;
  Surface surface;
  bool found = false;
};

inline Look look(const CompiledScene& scene, const Vec3& o, const Vec3& d, PrimitiveRef from = {}) {
  Look result;
  const RaySpan ray{&o.x, &o.y, &o.z, &d.x, &d.y, &d.z, nullptr, &from, 1};
  Hit& hit = result.hit;
  scene.accelerator->closest(ray, {&hit.primitive, &hit.t, &hit.u, &hit.v}, Coherence::incoherent);
  result.found = hit.primitive.hit();
  if (result.found) result.surface = surface_at(scene, hit, o, d);
  return result;
}

/// A scene of that shape alone, with a checker: only then are texture coordinates worked out.
inline Scene checkered(const Shape& shape) {
  Scene scene = scenes::empty(1);
  Material material = scenes::matte({1, 1, 1});
  scene.textures.push_back({CheckerTexture{}, {1, 1}, {0, 0}, ""});
  material.color = TextureId{0};
  scenes::add(scene, shape, material);
  return scene;
}

/// How far along unit n the box of the point's error reaches.
inline oracle::Real box_reach(const Surface& surface, const oracle::Vec& n) {
  const Vec3& e = surface.point.error;
  return std::fabs(n.x) * e.x + std::fabs(n.y) * e.y + std::fabs(n.z) * e.z;
}

}  // namespace tracer
