#pragma once
/// Point lights.

#include "tracer/src/lights/compiled_light.h"

namespace tracer {

template <>
struct LightTraits<PointLight> : PointTraits {
  template <class Space>
  static void compile(const PointLight& point, const Space& space, CompiledLight& light) {
    light.position = space.render_from_world(point.position);
  }
};

}  // namespace tracer
