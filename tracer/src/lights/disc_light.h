#pragma once
/// Disc lights: uniform emission over one disc, document fields and sampling.

#include "tracer/src/lights/compiled_light.h"

namespace tracer {

template <>
struct LightTraits<DiscLight> : PointTraits {
  template <class Space>
  static void compile(const DiscLight& disc, const Space& space, CompiledLight& light) {
    light.position = space.render_from_world(disc.center);
    const Axes axes = axes_across(normalize(disc.normal), {1, 0, 0});
    light.u = scaled(space, axes.e0 * disc.radius);
    light.v = scaled(space, axes.e1 * disc.radius);
  }
  /// The square root makes equal areas of equal steps of xi.x.
  static Vec3 point(const CompiledLight& light, const Vec2& xi) {
    const double phi = 2 * std::numbers::pi * xi.y;
    const double r = std::sqrt(xi.x);
    return light.position + light.u * (r * std::cos(phi)) + light.v * (r * std::sin(phi));
  }
};

}  // namespace tracer
