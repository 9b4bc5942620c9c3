#pragma once
/// Line lights: uniform emission along a segment, document fields and sampling.

#include "tracer/src/lights/compiled_light.h"

namespace tracer {

template <>
struct LightTraits<LineLight> : PointTraits {
  template <class Space>
  static void compile(const LineLight& line, const Space& space, CompiledLight& light) {
    light.position = space.render_from_world(line.from);
    light.u = scaled(space, line.to - line.from);
  }
  static Vec3 point(const CompiledLight& light, const Vec2& xi) { return light.position + light.u * xi.x; }
  static Vec3 center(const CompiledLight& light) { return light.position + light.u * 0.5; }
  template <class Checks>
  static void check(Checks& checks, const LineLight& line) {
    checks.apart("to", line.to, line.from, "must not be equal to `from`: the line has no length");
  }
};

}  // namespace tracer
