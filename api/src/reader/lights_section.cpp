#include <algorithm>
#include <cmath>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

enum class LightType { point, directional, spot, line, rect, disc, sphere };
using AttenuationKind = tracer::Attenuation::Kind;

constexpr Word<LightType>::Meaning light_types[] = {
    {"point", LightType::point},  {"directional", LightType::directional},
    {"spot", LightType::spot},    {"line", LightType::line},
    {"rect", LightType::rect},    {"disc", LightType::disc},
    {"sphere", LightType::sphere}};
constexpr Word<AttenuationKind>::Meaning attenuations[] = {{"none", AttenuationKind::none},
                                                           {"inverse_square", AttenuationKind::inverse_square}};

void read_attenuation(Reading& reading, const Cursor& at, tracer::Attenuation& attenuation) {
  if (at.node->kind == json::Kind::array) {
    attenuation.kind = AttenuationKind::polynomial;
    read(reading, at, attenuation.coefficients);
    return;
  }
  if (at.node->kind != json::Kind::string) {
    tell_wrong_type(reading, at, "\"none\", \"inverse_square\" or [c0, c1, c2]");
    return;
  }
  read(reading, at, Word<AttenuationKind>{attenuation.kind, "light.attenuation", attenuations});
}

/// A spot's axis by a point on it. Where that is wrong, so told, the axis stays what it is: nothing more to tell of it.
void read_target(Reading& reading, const Cursor& at, tracer::SpotLight& spot) {
  tracer::Vec3 target;
  if (!read(reading, at, target)) return;
  const tracer::Vec3& from = spot.position;
  const tracer::Vec3 axis{target.x - from.x, target.y - from.y, target.z - from.z};
  const double reach = std::max({std::abs(target.x), std::abs(target.y), std::abs(target.z)});
  const double length = std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)});
  if (const double bound = reading.limits.scene.coordinate_max; reach > bound) {
    tell(reading, at, "limit_exceeded", "its coordinates are over the limit coordinate_max");
  } else if (length < reading.limits.scene.length_min) {
    tell(reading, at, "degenerate", "must not be the position: the spot has no direction");
  } else if (std::isfinite(axis.x + axis.y + axis.z)) {  // not so where the position is missing or wrong
    spot.direction = axis;
  }
}

/// The axis is given by `direction` or by `target`, a point on it.
void read_spot(Reading& reading, Fields& fields, tracer::SpotLight& spot) {
  fields.set_kind("a spot light");
  fields.required("position", spot.position);
  if (const auto field = fields.take("target")) {
    if (fields.has("direction")) {
      tell(reading, *field, "conflict", "must not stand beside `direction`: either gives the axis");
      fields.take("direction");
    } else {
      read_target(reading, *field, spot);
    }
  } else {
    fields.required("direction", spot.direction);
  }
  fields.required("inner_angle", spot.inner_angle_deg);
  fields.required("outer_angle", spot.outer_angle_deg);
}

void read_line(Fields& fields, tracer::LineLight& line) {
  fields.set_kind("a line light");
  fields.required("from", line.from);
  fields.required("to", line.to);
}

void read_rect(Fields& fields, tracer::RectLight& rect) {
  fields.set_kind("a rect light");
  fields.required("corner", rect.corner);
  fields.required("edge_u", rect.edge_u);
  fields.required("edge_v", rect.edge_v);
}

void read_disc(Fields& fields, tracer::DiscLight& disc) {
  fields.set_kind("a disc light");
  fields.required("center", disc.center);
  fields.required("normal", disc.normal);
  fields.required("radius", disc.radius);
}

void read_sphere(Fields& fields, tracer::SphereLight& sphere) {
  fields.set_kind("a sphere light");
  fields.required("center", sphere.center);
  fields.required("radius", sphere.radius);
}

void read_source(Reading& reading, Fields& fields, LightType type, tracer::LightSource& source) {
  switch (type) {
    case LightType::point:
      fields.set_kind("a point light");
      fields.required("position", source.emplace<tracer::PointLight>().position);
      break;
    case LightType::directional:
      fields.set_kind("a directional light");
      fields.required("direction", source.emplace<tracer::DirectionalLight>().direction);
      break;
    case LightType::spot:
      return read_spot(reading, fields, source.emplace<tracer::SpotLight>());
    case LightType::line:
      return read_line(fields, source.emplace<tracer::LineLight>());
    case LightType::rect:
      return read_rect(fields, source.emplace<tracer::RectLight>());
    case LightType::disc:
      return read_disc(fields, source.emplace<tracer::DiscLight>());
    case LightType::sphere:
      return read_sphere(fields, source.emplace<tracer::SphereLight>());
  }
}

void read_light(Reading& reading, const Cursor& at) {
  tracer::Light& light = reading.scene().lights.emplace_back();
  Fields fields(reading, at, "a light");
  LightType type{};
  const bool type_known = fields.required("type", Word<LightType>{type, "light.type", light_types});
  fields.optional("color", light.color);
  fields.optional("intensity", light.intensity);
  fields.optional("shadows", light.shadows);
  if (const auto attenuation = fields.take("attenuation")) read_attenuation(reading, *attenuation, light.attenuation);
  if (!type_known) return;  // which other fields it may have is unknown
  read_source(reading, fields, type, light.source);
  fields.finish();
}

}  // namespace

void read_lights(Reading& reading, const Cursor& at) {
  if (!within_limit(reading, at, "lights", reading.limits.scene.lights)) return;
  for_each_element(reading, at, [&](const Cursor& light) { read_light(reading, light); });
}

}  // namespace api
