#pragma once
/// All lights. Compilation, sampling and validation select LightTraits here.

#include "tracer/src/lights/directional_light.h"
#include "tracer/src/lights/disc_light.h"
#include "tracer/src/lights/line_light.h"
#include "tracer/src/lights/point_light.h"
#include "tracer/src/lights/rect_light.h"
#include "tracer/src/lights/sphere_light.h"
#include "tracer/src/lights/spot_light.h"

namespace tracer {

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
