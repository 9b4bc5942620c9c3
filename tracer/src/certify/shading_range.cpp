#include "tracer/src/certify/shading_range.h"

#include "tracer/src/certify/shadow_range.h"
#include "tracer/src/math/power.h"

namespace tracer {
namespace {

/// Rounding of unit vectors, cosines and powers in the integrator: they differ from the forms by less.
constexpr double cosine_slack = 0x1p-44;

Interval product(const Interval& a, const Interval& b) {
  return {a.low * b.low, a.high > 0 && b.high > 0 ? a.high * b.high : 0};
}

/// The attenuation falls with the distance.
Interval attenuation_range(const Attenuation& attenuation, const Interval& distance) {
  const auto at = [&](double d) {
    return attenuation.kind == Attenuation::Kind::inverse_square ? inverse_square_attenuation(d)
                                                                 : polynomial_attenuation(attenuation.coefficients, d);
  };
  if (attenuation.kind == Attenuation::Kind::none) return {1, 1};
  if (!(distance.low > 0)) return {0, attenuation_bound(attenuation)};
  return {at(distance.high) * (1 - 0x1p-40), at(distance.low) * (1 + 0x1p-40)};
}

/// The factor grows with the cosine; its slope is at most 1.5 over the difference of the cosines.
Interval spot_range(const CompiledLight& light, const Interval& cosine) {
  const double width = light.cos_inner - light.cos_outer, slack = width > 0 ? 2 * cosine_slack / width : 0;
  const auto factor = [&](double c) { return spot_factor(c, light.cos_inner, light.cos_outer); };
  return {std::max(0.0, factor(cosine.low - cosine_slack) - slack),
          std::min(1.0, factor(cosine.high + cosine_slack) + slack)};
}

/// Range of c^n for c clamped to [0, 1].
Interval power_range(const Interval& base, double exponent) {
  const double slack = 0x1p-44 * (1 + exponent);  // the error of the logarithm is multiplied by the exponent
  return {std::max(0.0, power_of(std::clamp(base.low - cosine_slack, 0.0, 1.0), exponent) - slack),
          std::min(1.0, power_of(std::clamp(base.high + cosine_slack, 0.0, 1.0), exponent) + slack)};
}

/// Factors of a light that shines on the patch.
struct LightRange {
  Interval diffuse{}, specular{};  ///< N.L and the highlight, both with the attenuation
};

LightRange light_range(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays,
                       const CompiledLight& light) {
  const CompiledMaterial& material = bounds.scene.terms[patch.material];
  const bool directional = light.kind == light_kind<DirectionalLight>;
  AffineVec to_light = exactly(light.axis);
  Interval strength{1, 1};
  if (!directional) {
    const AffineVec offset = light_points(light) - patch.position;
    const AffineForm distance = square_root(squared_length(offset));
    to_light = offset * inverse(distance);
    const AffineForm world = distance * bounds.scene.frame.world_from_render(1.0);
    strength = attenuation_range(light.attenuation, world.range());
    if (light.kind == light_kind<SpotLight>)
      strength = product(strength, spot_range(light, (-dot(to_light, light.axis)).range()));
  }
  AffineForm cosine = dot(patch.normal, to_light);
  cosine.error += cosine_slack;
  const auto [low, high] = cosine.range();
  if (!(high > 0)) return {};
  LightRange range{product({std::max(0.0, low), std::min(high, 1 + 0x1p-40)}, strength), {}};
  if (is_black(material.specular)) return range;
  // phong_cosine() or blinn_cosine() to the material's power.
  const AffineVec to_eye = -normalized(rays.direction);
  const AffineForm to_normal = dot(patch.normal, to_eye), between = dot(to_light, to_eye);
  const AffineForm base =
      material.blinn ? (cosine + to_normal) * inverse(square_root(between * 2 + 2)) : cosine * to_normal * 2 - between;
  const Interval power = power_range(base.range(), material.shininess);
  range.specular = product({low > 0 ? power.low : 0, power.high}, strength);
  return range;
}

}  // namespace

ColorInterval shading_range(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays,
                            std::span<const Interval> visible) {
  const SceneBounds::MaterialRange& material = bounds.materials[patch.material];
  if (!patch.has_normal || material.may_be_hidden) return material.anywhere;
  ColorInterval added{};
  for (std::size_t number = 0; number < visible.size(); ++number) {
    const CompiledLight& light = bounds.scene.lights[number];
    if (visible[number].high == 0) continue;
    const LightRange range = light_range(bounds, patch, rays, light);
    const std::array<double, 3> radiance{light.radiance.r, light.radiance.g, light.radiance.b};
    for (std::size_t c = 0; c < 3; ++c) {
      const Interval diffuse = product(range.diffuse, material.diffuse[c]),
                     specular = product(range.specular, material.specular[c]),
                     lit = product(product({diffuse.low + specular.low, diffuse.high + specular.high}, visible[number]),
                                   {radiance[c], radiance[c]});
      added[c].low += bounds.culls ? 0 : lit.low;
      added[c].high += lit.high;
    }
  }
  ColorInterval range;
  for (std::size_t c = 0; c < 3; ++c) {
    added[c].high += material.other_max[c];
    range[c] = sum(material.emitted_ambient[c], added[c]);
    range[c].high = std::min(range[c].high, material.anywhere[c].high);
  }
  return range;
}

}  // namespace tracer
