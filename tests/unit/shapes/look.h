#pragma once
/// One ray into a compiled scene, and what shading would be told.

#include <gtest/gtest.h>

#include "tracer/compile.h"
#include "tracer/src/interaction/surface.h"

namespace tracer {

inline std::shared_ptr<const CompiledScene> compiled(const Scene& scene) {
  RenderControl control;
  auto result = compile(scene, control);
  EXPECT_TRUE(result.has_value());
  return *result;
}

/// The scene's first hit of a ray given in the render space; `found` false: none.
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

}  // namespace tracer
