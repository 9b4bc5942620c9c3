#pragma once
/// All lights, in render space. A light is its document fields (tracer/lights.h) and its LightTraits<Source>, which
/// compile, sample and validate it. All of these iterate over the alternatives of LightSource.

#include <array>
#include <cstdint>
#include <limits>
#include <numbers>

#include "tracer/src/math/affine.h"
#include "tracer/src/math/lanes.h"

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

/// Defaults of LightTraits<Source>, which also has compile(source, render_space, light).
struct PointTraits {
  /// The point of the light for `xi`, uniform in [0,1)^2: uniform over its length, area or surface.
  static Vec3 point(const CompiledLight& light, const Vec2& /*xi*/) { return light.position; }
  /// Center of its length, area or body.
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

template <>
struct LightTraits<PointLight> : PointTraits {
  template <class Space>
  static void compile(const PointLight& point, const Space& space, CompiledLight& light) {
    light.position = space.render_from_world(point.position);
  }
};

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

/// Parallel light from infinitely far away, without points or a center.
template <>
struct LightTraits<DirectionalLight> : PointTraits {
  template <class Space>
  static void compile(const DirectionalLight& directional, const Space& /*space*/, CompiledLight& light) {
    light.axis = -normalize(directional.direction);
  }
};

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

template <>
struct LightTraits<RectLight> : PointTraits {
  template <class Space>
  static void compile(const RectLight& rect, const Space& space, CompiledLight& light) {
    light.position = space.render_from_world(rect.corner);
    light.u = scaled(space, rect.edge_u);
    light.v = scaled(space, rect.edge_v);
  }
  static Vec3 point(const CompiledLight& light, const Vec2& xi) {
    return light.position + light.u * xi.x + light.v * xi.y;
  }
  static Vec3 center(const CompiledLight& light) { return light.position + (light.u + light.v) * 0.5; }
  template <class Checks>
  static void check(Checks& checks, const RectLight& rect) {
    checks.not_parallel("edge_v", rect.edge_v, rect.edge_u, "must not be parallel to edge_u: the light has no area");
  }
};

template <>
struct LightTraits<DiscLight> : PointTraits {
  template <class Space>
  static void compile(const DiscLight& disc, const Space& space, CompiledLight& light) {
    light.position = space.render_from_world(disc.center);
    const Axes axes = axes_across(normalize(disc.normal), {1, 0, 0});
    light.u = scaled(space, axes.e0 * disc.radius);
    light.v = scaled(space, axes.e1 * disc.radius);
  }
  /// The square root maps equal steps of xi.x to equal areas.
  static Vec3 point(const CompiledLight& light, const Vec2& xi) {
    const double phi = 2 * std::numbers::pi * xi.y;
    const double r = std::sqrt(xi.x);
    return light.position + light.u * (r * std::cos(phi)) + light.v * (r * std::sin(phi));
  }
};

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

/// `space` is a RenderSpace.
template <class Space>
CompiledLight compile_light(const Light& light, const Space& space) {
  CompiledLight compiled;
  compiled.kind = static_cast<std::uint8_t>(light.source.index());
  compiled.radiance = light.color * light.intensity;
  compiled.shadows = light.shadows;
  compiled.attenuation = light.attenuation;
  std::visit([&](const auto& source) { LightTraits<std::decay_t<decltype(source)>>::compile(source, space, compiled); },
             light.source);
  return compiled;
}

/// Calls visit(LightTraits<Source>{}) for the source of `kind`.
template <class Visit, class... Sources>
Vec3 visit_light_kind(std::uint8_t kind, const Visit& visit, const std::variant<Sources...>* /*list*/) {
  Vec3 result;
  (void)((kind == light_kind<Sources> && (result = visit(LightTraits<Sources>{}), true)) || ...);
  return result;
}

/// Precondition: not directional.
inline Vec3 light_point(const CompiledLight& light, const Vec2& xi) {
  return visit_light_kind(
      light.kind, [&](auto traits) { return traits.point(light, xi); }, static_cast<const LightSource*>(nullptr));
}

/// Precondition: not directional.
inline Vec3 light_center(const CompiledLight& light) {
  return visit_light_kind(
      light.kind, [&](auto traits) { return traits.center(light); }, static_cast<const LightSource*>(nullptr));
}

}  // namespace tracer
