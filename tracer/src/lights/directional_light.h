#pragma once
/// Directional lights: parallel light from infinitely far away. They have no points and no center.

#include "tracer/src/lights/compiled_light.h"

namespace tracer {

template <>
struct LightTraits<DirectionalLight> : PointTraits {
  template <class Space>
  static void compile(const DirectionalLight& directional, const Space& /*space*/, CompiledLight& light) {
    light.axis = -normalize(directional.direction);
  }
};

}  // namespace tracer
