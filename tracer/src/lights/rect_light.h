#pragma once
/// Parallelogram lights.

#include "tracer/src/lights/compiled_light.h"

namespace tracer {

template <>
struct LightTraits<RectLight> : PointTraits {
  template <class Space>
  static void compile(const RectLight& rect, const Space& space, CompiledLight& light) {
    light.position = space.render_from_world(rect.corner);
    light.u = scaled(space, rect.edge_u);
    light.v = scaled(space, rect.edge_v);
  }
  static Vec3 point(const CompiledLight& light, const Vec2& xi) {
    return light.position + light.u * xi.x + light.v * xi.y;
  }
  static Vec3 center(const CompiledLight& light) { return light.position + (light.u + light.v) * 0.5; }
  template <class Checks>
  static void check(Checks& checks, const RectLight& rect) {
    checks.not_parallel("edge_v", rect.edge_v, rect.edge_u, "must not be parallel to edge_u: the light has no area");
  }
};

}  // namespace tracer
