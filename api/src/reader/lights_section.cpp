#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

enum class LightType { point, directional };
using AttenuationKind = tracer::Attenuation::Kind;

constexpr Word<LightType>::Meaning light_types[] = {{"point", LightType::point},
                                                    {"directional", LightType::directional}};
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

void read_light(Reading& reading, const Cursor& at) {
  tracer::Light& light = reading.scene().lights.emplace_back();
  Fields fields(reading, at, "light", "a light");
  LightType type{};
  const bool type_known = fields.required("type", Word<LightType>{type, "light.type", light_types});
  fields.optional("color", light.color);
  fields.optional("intensity", light.intensity);
  fields.optional("shadows", light.shadows);
  if (const auto attenuation = fields.take("attenuation")) read_attenuation(reading, *attenuation, light.attenuation);
  if (!type_known) return;  // which other fields it may have is unknown
  if (type == LightType::point) {
    fields.call_it("a point light");
    fields.required("position", light.source.emplace<tracer::PointLight>().position);
  } else {
    fields.call_it("a directional light");
    fields.required("direction", light.source.emplace<tracer::DirectionalLight>().direction);
  }
  fields.finish();
}

}  // namespace

void read_lights(Reading& reading, const Cursor& at) {
  if (!within_limit(reading, at, "lights", reading.limits.scene.lights)) return;
  for_each_element(reading, at, [&](const Cursor& light) { read_light(reading, light); });
}

}  // namespace api
