#pragma once
/// Lights in render space. A light is its document fields (tracer/lights.h), a header that defines LightTraits for it,
/// and an include in light_registry.h.

#include <cstdint>
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
  Vec3 position{};                      ///< of the point or spot; one end, corner or centre of the others
  Vec3 u{}, v{};                        ///< line: u spans it; rect: edges; disc: radii at right angles
  double radius = 0;                    ///< of the sphere
  Vec3 axis{};                          ///< unit. directional: towards the light; spot: direction of its axis
  double cos_inner = 1, cos_outer = 0;  ///< spot
  Color radiance{};                     ///< color * intensity
  bool shadows = true;
  Attenuation attenuation{};  ///< of world distances

  [[nodiscard]] bool is_area_light() const {
    return is_area_light_kind(kind, static_cast<const LightSource*>(nullptr));
  }
};

/// Defaults of LightTraits<Source>, which also has compile(source, render_space, light).
struct PointTraits {
  /// The point of the light for `xi`, uniform in [0,1)^2: uniform over its length, area or surface.
  static Vec3 point(const CompiledLight& light, const Vec2& /*xi*/) { return light.position; }
  /// Middle of its length, area or body.
  static Vec3 center(const CompiledLight& light) { return light.position; }
  /// Rules between its fields.
  template <class Checks, class Source>
  static void check(Checks& /*checks*/, const Source& /*source*/) {}

 protected:
  template <class Space>
  static Vec3 scaled(const Space& space, const Vec3& v) {
    return {space.render_from_world(v.x), space.render_from_world(v.y), space.render_from_world(v.z)};
  }
};

template <class Source>
struct LightTraits;

}  // namespace tracer
