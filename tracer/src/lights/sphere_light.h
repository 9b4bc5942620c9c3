#pragma once
/// Sphere lights: uniform emission over a sphere, document fields and sampling.

#include "tracer/src/lights/compiled_light.h"

namespace tracer {

template <>
struct LightTraits<SphereLight> : PointTraits {
  template <class Space>
  static void compile(const SphereLight& sphere, const Space& space, CompiledLight& light) {
    light.position = space.render_from_world(sphere.center);
    light.radius = space.render_from_world(sphere.radius);
  }
  /// Equal heights have equal areas (Archimedes).
  static Vec3 point(const CompiledLight& light, const Vec2& xi) {
    const double phi = 2 * std::numbers::pi * xi.y;
    const double z = 1 - 2 * xi.x;
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    return light.position + Vec3{r * std::cos(phi), r * std::sin(phi), z} * light.radius;
  }
};

}  // namespace tracer
