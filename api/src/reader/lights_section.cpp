#include <algorithm>
#include <cmath>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {

using AttenuationKind = tracer::Attenuation::Kind;

template <>
inline constexpr Word<AttenuationKind> words<AttenuationKind>[] = {{"none", AttenuationKind::none},
                                                                   {"inverse_square", AttenuationKind::inverse_square}};

namespace {

bool read_attenuation(Reading& reading, const Cursor& at, tracer::Attenuation& attenuation) {
  if (at.node->kind == json::Kind::string) return read(reading, at, attenuation.kind);
  if (at.node->kind != json::Kind::array)
    return add_wrong_type(reading, at, "\"none\", \"inverse_square\" or [c0, c1, c2]");
  attenuation.kind = AttenuationKind::polynomial;
  return read(reading, at, attenuation.coefficients);
}

/// Sets a spot light's axis by a point on it. If the point is invalid, the axis keeps its default.
void read_target(Reading& reading, const Cursor& at, tracer::SpotLight& spot) {
  tracer::Vec3 target;
  if (!read(reading, at, target)) return;
  const tracer::Vec3& from = spot.position;
  const tracer::Vec3 axis{target.x - from.x, target.y - from.y, target.z - from.z};
  const double reach = std::max({std::abs(target.x), std::abs(target.y), std::abs(target.z)});
  const double length = std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)});
  if (reach > reading.limits.scene.coordinate_max) {
    add_issue(reading, at, "limit_exceeded", "its coordinates exceed the limit coordinate_max");
  } else if (length < reading.limits.scene.length_min) {
    add_issue(reading, at, "degenerate", "must not be the position: the spot has no direction");
  } else if (std::isfinite(axis.x + axis.y + axis.z)) {  // false if the position is missing or invalid
    spot.direction = axis;
  }
}

template <class Source>
void read_source(Reading& /*reading*/, Fields& fields, Source& source) {
  read_all_fields(fields, source);
}

/// The axis is given by `direction` or by `target`, a point on it.
void read_source(Reading& reading, Fields& fields, tracer::SpotLight& spot) {
  const auto target = fields.take("target");
  tracer::for_each_field<tracer::SpotLight>([&](const auto& field) {
    if (field.name != "direction" || !target) read_field(fields, field, spot);
  });
  if (!target) return;
  if (fields.take("direction")) {
    add_issue(reading, *target, "conflict", "must not be combined with `direction`: each gives the axis");
  } else {
    read_target(reading, *target, spot);
  }
}

void read_light(Reading& reading, const Cursor& at) {
  tracer::Light& light = reading.scene().lights.emplace_back();
  Fields fields(reading, at, "a light");
  std::size_t type = 0;
  const bool type_known = fields.required("type", OneOf<std::size_t>{type, type_words<tracer::LightSource>});
  fields.optional("color", light.color);
  fields.optional("intensity", light.intensity);
  fields.optional("shadows", light.shadows);
  if (const auto attenuation = fields.take("attenuation")) read_attenuation(reading, *attenuation, light.attenuation);
  if (!type_known) return;  // its other fields depend on the type
  read_alternative(light.source, type, [&](auto& source) {
    fields.set_kind(source.noun);
    read_source(reading, fields, source);
  });
  fields.finish();
}

}  // namespace

void read_lights(Reading& reading, const Cursor& at) {
  if (!within_limit(reading, at, "lights", reading.limits.scene.lights)) return;
  for_each_element(reading, at, [&](const Cursor& light) { read_light(reading, light); });
}

}  // namespace api
