#pragma once
/// Lights in render space. A light is its document fields (tracer/lights.h) and its LightTraits (light_registry.h).

#include <array>
#include <cstdint>
#include <limits>
#include <numbers>

#include "tracer/src/math/affine.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// Position of a light's struct among the alternatives of LightSource.
template <class Source, class Sources = LightSource>
inline constexpr std::uint8_t light_kind = 0;
template <class Source, class First, class... Others>
inline constexpr std::uint8_t light_kind<Source, std::variant<First, Others...>> =
    std::is_same_v<Source, First> ? 0 : 1 + light_kind<Source, std::variant<Others...>>;
template <class Source>
inline constexpr std::uint8_t light_kind<Source, std::variant<>> = 0;

template <class... Sources>
constexpr bool is_area_light_kind(std::uint8_t kind, const std::variant<Sources...>* /*list*/) {
  return ((kind == light_kind<Sources> && Sources::is_area_light) || ...);
}

struct CompiledLight {
  std::uint8_t kind = light_kind<PointLight>;
  Vec3 position{};                      ///< center of points, spots, spheres and discs; else one end or corner
  Vec3 u{}, v{};                        ///< line: u spans it; rect: edges; disc: radii at right angles
  double radius = 0;                    ///< sphere
  Vec3 axis{};                          ///< unit. directional: towards the light; spot: direction of its axis
  double cos_inner = 1, cos_outer = 0;  ///< spot
  Color radiance{};                     ///< color * intensity
  bool shadows = true;
  Attenuation attenuation{};  ///< takes world distances

  [[nodiscard]] bool is_area_light() const {
    return is_area_light_kind(kind, static_cast<const LightSource*>(nullptr));
  }
};

/// Attenuation at distance d >= 0 in scene units (Foley, van Dam, Feiner, Hughes 1990, eq. 16.8 for the capped
/// polynomial).
WHITTLE_INLINE double polynomial_attenuation(const std::array<double, 3>& c, double d) {
  const double f = 1 / (c[0] + (c[1] + c[2] * d) * d);
  return 1 < f ? 1 : f;
}
WHITTLE_INLINE double inverse_square_attenuation(double d) { return 1 / (d * d); }

/// Upper bound of the attenuation at any distance, for any coefficients.
inline double attenuation_bound(const Attenuation& attenuation) {
  return attenuation.kind == Attenuation::Kind::inverse_square ? std::numeric_limits<double>::infinity() : 1;
}

}  // namespace tracer
