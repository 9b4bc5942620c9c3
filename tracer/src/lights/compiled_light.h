#pragma once
/// Lights in the trace frame, and points on them.

#include <numbers>

#include "tracer/src/math/affine.h"
#include "tracer/src/math/wide.h"

namespace tracer {

struct CompiledLight {
  enum class Kind { point, directional, spot, line, parallelogram, disc, sphere };
  Kind kind = Kind::point;
  Vec3 position{};                      ///< of the point or spot; one end, corner or centre of the others
  Vec3 u{}, v{};                        ///< line: u spans it; parallelogram: edges; disc: radii at right angles
  double radius = 0;                    ///< of the sphere
  Vec3 axis{};                          ///< unit. directional: towards the light; spot: the way it shines
  double cos_inner = 1, cos_outer = 0;  ///< spot
  Color radiance{};                     ///< color * intensity
  bool shadows = true;
  Attenuation attenuation{};  ///< of world distances

  /// Spread over a length, area or surface, so that it takes several points to know it.
  [[nodiscard]] bool soft() const { return kind >= Kind::line; }
};

/// The point of the light that `xi`, uniform in [0,1)^2, stands for: uniform over its length, area or surface.
/// Precondition: not directional.
inline Vec3 light_point(const CompiledLight& light, const Vec2& xi) {
  const double phi = 2 * std::numbers::pi * xi.y;
  switch (light.kind) {
    case CompiledLight::Kind::line:
      return light.position + light.u * xi.x;
    case CompiledLight::Kind::parallelogram:
      return light.position + light.u * xi.x + light.v * xi.y;
    case CompiledLight::Kind::disc: {
      const double r = std::sqrt(xi.x);  // equal areas for equal steps of xi.x
      return light.position + light.u * (r * std::cos(phi)) + light.v * (r * std::sin(phi));
    }
    case CompiledLight::Kind::sphere: {
      const double z = 1 - 2 * xi.x;  // Archimedes: equal areas for equal heights
      const double r = std::sqrt(std::max(0.0, 1 - z * z));
      return light.position + Vec3{r * std::cos(phi), r * std::sin(phi), z} * light.radius;
    }
    default:
      return light.position;
  }
}

/// The middle of its length, area or body; of a directional light nothing that means anything.
inline Vec3 light_center(const CompiledLight& light) {
  const bool spanned = light.kind == CompiledLight::Kind::line || light.kind == CompiledLight::Kind::parallelogram;
  return spanned ? light.position + (light.u + light.v) * 0.5 : light.position;
}

/// How much of a spot's light goes along a direction at the angle of cosine `c` to its axis: all within the inner cone,
/// none outside the outer one.
WHITTLE_INLINE double spot_factor(double c, double cos_inner, double cos_outer) {
  const double x = (c - cos_outer) / (cos_inner - cos_outer);
  const double between = x * x * (3 - 2 * x);
  return c >= cos_inner ? 1 : (c <= cos_outer ? 0 : between);
}

}  // namespace tracer
