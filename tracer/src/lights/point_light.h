#pragma once
/// Point lights: emission from one position, document fields.

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
