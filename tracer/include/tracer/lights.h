#pragma once
/// Light sources of a scene document. Each lists its fields; tracer/src/lights implements its samples.

#include <variant>

#include "tracer/document_fields.h"
#include "tracer/values.h"

namespace tracer {

struct PointLight {
  Vec3 position{};

  static constexpr bool is_area_light = false;
  static constexpr std::string_view type = "point", noun = "a point light";
  static constexpr auto fields() { return std::tuple{Field{"position", &PointLight::position, FieldRange::position}}; }
};

struct DirectionalLight {
  Vec3 direction{0, -1, 0};  ///< in which the light travels; any length > 0

  static constexpr bool is_area_light = false;
  static constexpr std::string_view type = "directional", noun = "a directional light";
  static constexpr auto fields() {
    return std::tuple{Field{"direction", &DirectionalLight::direction, FieldRange::direction}};
  }
};

/// Full inside `inner_angle_deg` of its axis, nothing outside `outer_angle_deg` (half angles), between them the
/// smoothstep of the cosine.
struct SpotLight {
  Vec3 position{};
  Vec3 direction{0, -1, 0};  ///< the axis; any length > 0
  double inner_angle_deg = 15, outer_angle_deg = 30;

  static constexpr bool is_area_light = false;
  static constexpr std::string_view type = "spot", noun = "a spot light";
  static constexpr auto fields() {
    return std::tuple{Field{"position", &SpotLight::position, FieldRange::position},
                      Field{"direction", &SpotLight::direction, FieldRange::direction},
                      Field{"inner_angle", &SpotLight::inner_angle_deg, FieldRange::within(0, 180)},
                      Field{"outer_angle", &SpotLight::outer_angle_deg, FieldRange::within(0, 180)}};
  }
};

// Area lights: the mean of point lights spread uniformly over a length, an area or a surface. The part of the light
// that is hidden from a point is missing from the mean there, so their shadows are soft.

struct LineLight {
  Vec3 from{}, to{1, 0, 0};

  static constexpr bool is_area_light = true;
  static constexpr std::string_view type = "line", noun = "a line light";
  static constexpr auto fields() {
    return std::tuple{Field{"from", &LineLight::from, FieldRange::position},
                      Field{"to", &LineLight::to, FieldRange::position}};
  }
};

struct RectLight {
  Vec3 corner{};
  Vec3 edge_u{1, 0, 0}, edge_v{0, 0, 1};  ///< a parallelogram; need not be at right angles

  static constexpr bool is_area_light = true;
  static constexpr std::string_view type = "rect", noun = "a rect light";
  static constexpr auto fields() {
    return std::tuple{Field{"corner", &RectLight::corner, FieldRange::position},
                      Field{"edge_u", &RectLight::edge_u, FieldRange::direction},
                      Field{"edge_v", &RectLight::edge_v, FieldRange::direction}};
  }
};

struct DiscLight {
  Vec3 center{};
  Vec3 normal{0, -1, 0};
  double radius = 1;

  static constexpr bool is_area_light = true;
  static constexpr std::string_view type = "disc", noun = "a disc light";
  static constexpr auto fields() {
    return std::tuple{Field{"center", &DiscLight::center, FieldRange::position},
                      Field{"normal", &DiscLight::normal, FieldRange::direction},
                      Field{"radius", &DiscLight::radius, FieldRange::length}};
  }
};

struct SphereLight {
  Vec3 center{};
  double radius = 1;

  static constexpr bool is_area_light = true;
  static constexpr std::string_view type = "sphere", noun = "a sphere light";
  static constexpr auto fields() {
    return std::tuple{Field{"center", &SphereLight::center, FieldRange::position},
                      Field{"radius", &SphereLight::radius, FieldRange::length}};
  }
};

using LightSource = std::variant<PointLight, DirectionalLight, SpotLight, LineLight, RectLight, DiscLight, SphereLight>;

inline bool is_area_light(const LightSource& source) {
  return std::visit([](const auto& light) { return light.is_area_light; }, source);
}

}  // namespace tracer
