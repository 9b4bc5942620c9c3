#include "tracer/src/certify/shading_range.h"

#include "tracer/src/certify/shadow_range.h"
#include "tracer/src/math/power.h"

namespace tracer {
namespace {

std::array<double, 3> channels_of(const Color& c) { return {c.r, c.g, c.b}; }

/// Coefficients of a material over ranges of its colors, with which they grow. `range_of` returns the range of a
/// ColorOrTexture.
struct CoefficientRanges {
  ColorInterval emitted_ambient, diffuse, specular, diffuse_transmission, specular_transmission;

  template <class RangeOf>
  CoefficientRanges(const SceneBounds& bounds, std::uint32_t material, const RangeOf& range_of) {
    const CompiledScene& scene = bounds.scene;
    const CompiledMaterial& terms = scene.terms_of(bounds.approximate)[material];
    if (!terms.textured) {
      for (const auto& [range, coefficient] : parts) this->*range = interval_of(terms.*coefficient);
      return;
    }
    const auto at_end = [&](double Interval::*end) {
      return coefficients(scene.materials[material], scene.ambient_of(bounds.approximate),
                          [&](const ColorOrTexture& color) {
                            const ColorInterval range = range_of(color);
                            return Color{range[0].*end, range[1].*end, range[2].*end};
                          });
    };
    const Coefficients low = at_end(&Interval::low), high = at_end(&Interval::high);
    for (const auto& [range, coefficient] : parts)
      this->*range = hull(interval_of(low.*coefficient), interval_of(high.*coefficient));
  }

 private:
  struct Part {
    ColorInterval CoefficientRanges::*range;
    Color Coefficients::*coefficient;
  };
  static constexpr Part parts[] = {{&CoefficientRanges::emitted_ambient, &Coefficients::emitted_ambient},
                                   {&CoefficientRanges::diffuse, &Coefficients::diffuse},
                                   {&CoefficientRanges::specular, &Coefficients::specular},
                                   {&CoefficientRanges::diffuse_transmission, &Coefficients::diffuse_transmission},
                                   {&CoefficientRanges::specular_transmission, &Coefficients::specular_transmission}};
};

/// The form of a factor in a range.
WHITTLE_INLINE AffineForm scaled(const AffineForm& form, const Interval& factor) {
  return factor.low == factor.high ? form * factor.low : form * form_of(factor);
}

/// Fractions of one light at one side of a patch.
struct LightForms {
  AffineForm cosine{};     ///< N.L with the normal of the side, or 0 from the other side
  AffineForm strength{};   ///< attenuation and spot cone
  AffineForm highlight{};  ///< specular term; not on the far side
};

/// Largest value of the attenuation, if the light is at least `distance` away.
double attenuation_max(const Attenuation& attenuation, double distance) {
  if (attenuation.kind != Attenuation::Kind::inverse_square) return 1;
  return inverse_square_attenuation(distance * (1 - 0x1p-40));
}

AffineForm attenuation_form(const Attenuation& attenuation, const AffineForm& distance) {
  switch (attenuation.kind) {
    case Attenuation::Kind::none:
      return exactly(1);
    case Attenuation::Kind::inverse_square:
      return inverse(squared(distance));
    case Attenuation::Kind::polynomial:
      break;
  }
  const auto& c = attenuation.coefficients;
  const AffineForm form = inverse((distance * c[2] + c[1]) * distance + c[0]);
  const Interval range = form.range();
  if (range.low >= 1) return exactly(1);
  return range.high <= 1 ? form : form_of({std::max(0.0, range.low), 1});
}

/// Rounding of unit vectors, cosines and powers in the integrator: they differ from the forms by less.
constexpr double cosine_slack = 0x1p-44;

Interval spot_range(const CompiledLight& light, const AffineForm& cosine) {
  const auto [low, high] = cosine.range();
  const auto factor = [&](double c) { return spot_factor(c, light.cos_inner, light.cos_outer); };
  // The slope of the factor is at most 1.5 over the difference of the cosines.
  const double width = light.cos_inner - light.cos_outer;
  const double slack = width > 0 ? 2 * cosine_slack / width : 0;
  return {std::max(0.0, factor(low - cosine_slack) - slack), std::min(1.0, factor(high + cosine_slack) + slack)};
}

/// Range of c^n for c clamped to [0, 1].
Interval power_range(const Interval& base, double exponent) {
  const double low = power_of(std::max(0.0, base.low - cosine_slack), exponent);
  const double high = power_of(std::max(0.0, base.high + cosine_slack), exponent);
  const double slack = 0x1p-44 * (1 + exponent);  // the error of the logarithm is multiplied by the exponent
  return {std::max(0.0, low - slack), std::min(1.0, high + slack)};
}

/// c^n for c clamped to [0, 1]: convex for n >= 1, so that the secant bounds it from above and its parallel tangent, at
/// c = (slope / n)^(1 / (n - 1)), from below.
AffineForm power_form(const AffineForm& base, double exponent) {
  const Interval range = base.range(), power = power_range(range, exponent);
  const double low = std::max(0.0, range.low), slope = (power.high - power.low) / (range.high - low);
  const AffineForm interval = form_of(power);
  if (!(exponent > 1 && range.high <= 1 + 0x1p-20 && range.low > -1 && power.high > power.low && slope > 0))
    return interval;
  const double touching = power_of(slope / exponent, 1 / (exponent - 1));
  const double at = std::clamp(touching, low, range.high);
  const double above = std::max(power.low - slope * low, power.high - slope * range.high);
  const double below =
      std::min({power_of(at, exponent) - slope * at, power.low - slope * low, power.high - slope * range.high});
  // Below 0 the power is 0, and the line is lower by the slope times the distance.
  const double clamped = slope * std::max(0.0, -range.low);
  const double slack = 0x1p-40 * (1 + slope) + 0x1p-44 * exponent;
  const AffineForm form = linear(base, slope, 0.5 * (above + clamped + below), 0.5 * (above + clamped - below) + slack);
  return form.error < interval.error ? form : interval;
}

/// The patch with the directions to one light.
class LightAtPatch {
 public:
  LightAtPatch(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays,
               const CompiledMaterial& material)
      : bounds_(bounds), patch_(patch), material_(material) {
    has_specular_ = !is_black(material.specular);
    if (has_specular_) to_eye_ = -normalized(rays.direction);
    // Textures perturb the normal to any direction.
    has_normal_ = patch.has_normal && !material.has_normal_map;
  }

  [[nodiscard]] LightForms forms(const CompiledLight& light, bool far_side) const {
    LightForms forms;
    AffineVec to_light;
    if (light.kind == light_kind<DirectionalLight>) {
      to_light = exactly(light.axis);
      forms.strength = exactly(1);
      if (has_normal_) forms.cosine = dot(patch_.normal, light.axis);
    } else {
      const AffineVec points = light_points(light), offset = points - patch_.position;
      const AffineForm distance = square_root(squared_length(offset));
      const AffineForm scale = inverse(distance);
      to_light = offset * scale;
      forms.strength = attenuation_form(light.attenuation, distance * bounds_.scene.frame.world_from_render(1.0));
      if (light.kind == light_kind<SpotLight>) {
        const AffineForm cosine = -dot(to_light, light.axis);
        forms.strength = forms.strength * form_of(spot_range(light, cosine));
      }
      if (has_normal_) forms.cosine = height(points, offset) * scale;
    }
    if (!has_normal_) {
      forms.cosine = form_of({0, 1});
      forms.highlight = form_of({0, has_specular_ ? 1.0 : 0.0});
      return forms;
    }
    forms.cosine.error += cosine_slack;
    if (has_specular_ && !far_side) forms.highlight = highlight(forms.cosine, to_light);
    forms.cosine = positive_part(far_side ? -forms.cosine : forms.cosine);
    return forms;
  }

 private:
  /// N.(l - p), which is the same at all points p of a plane.
  [[nodiscard]] AffineForm height(const AffineVec& points, const AffineVec& offset) const {
    if (!patch_.flat) return dot(patch_.normal, offset);
    const AffineVec from_anchor = points - patch_.anchor;
    AffineForm height = dot(from_anchor, patch_.flat_normal);
    height.error += (magnitude(from_anchor) + magnitude(patch_.position)) * cosine_slack;
    return height;
  }

  /// phong_cosine() or blinn_cosine() to the material's power.
  [[nodiscard]] AffineForm highlight(const AffineForm& cosine, const AffineVec& to_light) const {
    const Interval range = cosine.range();
    if (range.high <= 0) return {};
    const AffineForm to_normal = dot(patch_.normal, to_eye_), between = dot(to_light, to_eye_);
    AffineForm base;
    if (material_.blinn) {
      base = (cosine + to_normal) * inverse(square_root(between * 2 + 2));
    } else {
      base = cosine * to_normal * 2 - between;
    }
    const AffineForm power = power_form(base, material_.shininess);
    return range.low > 0 ? power : form_of({0, std::max(0.0, power.range().high)});
  }

  const SceneBounds& bounds_;
  const SurfacePatch& patch_;
  const CompiledMaterial& material_;
  AffineVec to_eye_;
  bool has_specular_ = false, has_normal_ = false;
};

/// A light at one side of a patch.
struct LitSide {
  AffineForm arriving, highlight;  ///< both with the strength of the light
  const ColorInterval &diffuse, &specular;
  Interval visible;
};

WHITTLE_INLINE void add_light(const CompiledLight& light, const LitSide& side, LocalRadiance& sum) {
  sum.any_light = true;
  const std::array<double, 3> radiance = channels_of(light.radiance);
  for (std::size_t c = 0; c < 3; ++c) {
    const Interval &diffuse = side.diffuse[c], &specular = side.specular[c];
    AffineForm lit = scaled(side.arriving, diffuse);
    if (specular.high > 0) lit = lit + scaled(side.highlight, specular);
    lit = lit * radiance[c];
    const double reflected = diffuse.high + specular.high;
    const double largest = radiance[c] * attenuation_bound(light.attenuation) * side.visible.high * reflected;
    if (radiance[c] > 0 && reflected > 0) sum.light_max[c] += largest;
    if (side.visible.low < 1) lit = form_of({0, std::max(0.0, lit.range().high) * side.visible.high});
    sum.light[c] = sum.light[c] + lit;
  }
}

/// Adds a light that comes through the surface.
void add_light_behind(const SceneBounds& bounds, const CompiledLight& light, const LightAtPatch& at_patch,
                      const CoefficientRanges& coefficients, LocalRadiance& sum) {
  const LightForms forms = at_patch.forms(light, true);
  if (!(forms.cosine.range().high > 0)) return;
  // The shadows of the far side are not bounded.
  const Interval visible{light.shadows || bounds.approximate.any() ? 0.0 : 1.0,
                         light.shadows ? bounds.transmittance_max : 1.0};
  add_light(light,
            {forms.cosine * forms.strength, form_of({0, 1}) * forms.strength, coefficients.diffuse_transmission,
             coefficients.specular_transmission, visible},
            sum);
}

/// Adds emitted and ambient light, and what the integrator may cull or round.
ColorInterval finish(const SceneBounds& bounds, const ColorInterval& emitted_ambient, const ColorInterval& light) {
  ColorInterval radiance = emitted_ambient;
  const bool culls = bounds.scene.needs.many_lights || bounds.scene.exact.needs.many_lights;
  const double culled = culls ? bounds.scene.accuracy.cutoff : 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double low = radiance[c].low + std::max(0.0, light[c].low - culled), high = radiance[c].high + light[c].high;
    radiance[c] = {low * (1 - 0x1p-40), high * (1 + 0x1p-40)};
  }
  return radiance;
}

}  // namespace

double LocalRadiance::nonlinear_width(double dark, double side) const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double largest = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double linear = (std::abs(light[c].x) + std::abs(light[c].y)) / (4 * side);
    const double width =
        emitted_ambient[c].high - emitted_ambient[c].low + (any_light ? 2 * light[c].error - linear : 0);
    const double high = emitted_ambient[c].high + (any_light ? std::min(light[c].range().high, light_max[c]) : 0);
    if (width > 0) largest = std::max(largest, high < infinity ? width / std::max(high, dark) : infinity);
  }
  return largest;
}

LocalRadiance local_radiance(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays, double width,
                             std::span<const Interval> visible_lights) {
  const CompiledScene& scene = bounds.scene;
  const CompiledMaterial& material = scene.terms[patch.material];
  const CoefficientRanges coefficients(bounds, patch.material, [&](const ColorOrTexture& color) {
    return color_range(scene, bounds.textures, color, patch, rays, width);
  });
  const LightAtPatch at_patch(bounds, patch, rays, material);
  LocalRadiance sum{.emitted_ambient = coefficients.emitted_ambient};
  for (std::size_t number = 0; number < scene.lights.size(); ++number) {
    const CompiledLight& light = scene.lights[number];
    const Interval visible = visible_lights[number];
    if (visible.high > 0) {
      const LightForms forms = at_patch.forms(light, false);
      if (forms.cosine.range().high > 0)
        add_light(light,
                  {forms.cosine * forms.strength, forms.highlight * forms.strength, coefficients.diffuse,
                   coefficients.specular, visible},
                  sum);
    }
    if (material.transmits_light) add_light_behind(bounds, light, at_patch, coefficients, sum);
  }
  return sum;
}

ColorInterval range_of(const SceneBounds& bounds, const LocalRadiance& radiance, const BlockPart& part) {
  if (!radiance.any_light) return radiance.emitted_ambient;
  ColorInterval light{};
  for (std::size_t c = 0; c < 3; ++c) {
    const Interval range = restricted(radiance.light[c], part).range();
    light[c] = {std::max(0.0, range.low), std::min(range.high, radiance.light_max[c])};
  }
  return finish(bounds, radiance.emitted_ambient, light);
}

ColorInterval local_radiance(const SceneBounds& bounds, std::uint32_t material, double distance) {
  const CompiledScene& scene = bounds.scene;
  const CoefficientRanges coefficients(
      bounds, material, [&](const ColorOrTexture& color) { return color_range(bounds.textures, color); });
  ColorInterval sum{};
  for (const CompiledLight& light : scene.lights) {
    const std::array<double, 3> radiance = channels_of(light.radiance);
    const double visible = light.shadows ? bounds.transmittance_max : 1;
    const double strength = attenuation_max(light.attenuation, distance);
    for (std::size_t c = 0; c < 3; ++c) {
      // A light is on one side of the surface.
      const double near = coefficients.diffuse[c].high + coefficients.specular[c].high;
      const double far = coefficients.diffuse_transmission[c].high + coefficients.specular_transmission[c].high;
      const double reflected = radiance[c] * std::max(near, far);
      if (reflected > 0) sum[c].high += reflected * strength * visible;
    }
  }
  return scene.lights.empty() ? coefficients.emitted_ambient : finish(bounds, coefficients.emitted_ambient, sum);
}

Color secondary_factor(const SceneBounds& bounds, std::uint32_t material) {
  const auto& [reflectance, transmittance] = bounds.secondary_max[material];
  // Fresnel's reflectance and transmittance add up to one.
  if (bounds.scene.terms[material].fresnel)
    return {std::max(reflectance.r, transmittance.r), std::max(reflectance.g, transmittance.g),
            std::max(reflectance.b, transmittance.b)};
  return reflectance + transmittance;
}

ColorInterval with_secondary_rays(const SceneBounds& bounds, std::uint32_t material, ColorInterval local) {
  const CompiledMaterial& terms = bounds.scene.terms[material];
  const std::array<double, 3> factor = channels_of(secondary_factor(bounds, material));
  for (std::size_t c = 0; c < 3; ++c)
    if (factor[c] > 0 && bounds.radiance_max > 0)
      local[c].high = (local[c].high + factor[c] * bounds.radiance_max) * (1 + 0x1p-40);
  // A surface in a solid of higher priority is not shaded: the ray continues.
  return terms.transmits && bounds.overlapping_media ? hull(local, bounds.any_radiance()) : local;
}

}  // namespace tracer
