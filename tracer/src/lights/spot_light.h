#pragma once
/// Spot lights: point lights within a cone.

#include "tracer/src/lights/compiled_light.h"

namespace tracer {

/// Share of a spot's light along a direction whose angle to the axis has the cosine `c`: 1 within the inner cone, 0
/// outside the outer cone.
WHITTLE_INLINE double spot_factor(double c, double cos_inner, double cos_outer) {
  const double x = (c - cos_outer) / (cos_inner - cos_outer);
  const double between = x * x * (3 - 2 * x);
  return c >= cos_inner ? 1 : (c <= cos_outer ? 0 : between);
}

template <>
struct LightTraits<SpotLight> : PointTraits {
  template <class Space>
  static void compile(const SpotLight& spot, const Space& space, CompiledLight& light) {
    light.position = space.render_from_world(spot.position);
    light.axis = normalize(spot.direction);
    light.cos_inner = std::cos(spot.inner_angle_deg * (std::numbers::pi / 180));
    light.cos_outer = std::cos(spot.outer_angle_deg * (std::numbers::pi / 180));
  }
  template <class Checks>
  static void check(Checks& checks, const SpotLight& spot) {
    checks.at_least("outer_angle", spot.outer_angle_deg, "inner_angle", spot.inner_angle_deg);
  }
};

}  // namespace tracer
