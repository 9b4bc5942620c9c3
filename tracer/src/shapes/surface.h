#pragma once
/// From "this ray meets that primitive at t" to everything shading needs to know of the point.

#include "tracer/src/compiled_scene.h"
#include "tracer/src/math/rounding.h"

namespace tracer {

struct Surface {
  BoundedPoint point;     ///< trace frame, refined onto the primitive
  Vec3 geometric_normal;  ///< unit, outward (front) side
  Vec3 normal;            ///< unit shading normal on the ray's side
  bool back = false;      ///< the ray meets the back side
  std::uint32_t material = 0;
  std::uint32_t object = 0;
  Vec2 uv;  ///< 0,0 unless the material is textured
};

/// A hit as the accelerator tells it.
struct Hit {
  PrimitiveRef primitive;
  double t = 0, u = 0, v = 0;
};

/// Precondition: `hit.primitive.hit()`, and `direction` is unit.
Surface surface_at(const CompiledScene& scene, const Hit& hit, const Vec3& origin, const Vec3& direction);

}  // namespace tracer
