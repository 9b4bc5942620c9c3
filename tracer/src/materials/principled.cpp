#include "tracer/src/materials/principled.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tracer/src/math/optics.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

/// Schlick 1994, "An Inexpensive BRDF Model for Physically-based Rendering": shares of f0 and f90 of one facet.
FacetAlbedo schlick(double cosine) {
  const double x = 1 - std::min(cosine, 1.0), grazing = x * x * x * x * x;
  return {1 - grazing, grazing};
}

/// sqrt(a^2 + (1 - a^2) c^2): Smith's masking of one direction is 2 c / (c + that).
double masking_root(double cosine, double alpha) {
  const double squared = alpha * alpha;
  return std::sqrt(squared + (1 - squared) * cosine * cosine);
}

/// D of a facet whose normal has the cosine c to the surface's, and the sine s.
double distribution(double cosine, double sine_squared, double alpha) {
  const double root = sine_squared + alpha * alpha * cosine * cosine;
  return alpha * alpha / (std::numbers::pi * root * root);
}

/// The normal of a visible facet in the frame of the surface, for the view `v` with v.z > 0.
Vec3 visible_facet(const Vec3& v, double alpha, const Vec2& xi) {
  // On a sphere's upper half, which stretches to the distribution, facets are visible in proportion to a disc's area.
  const Vec3 stretched = normalize({alpha * v.x, alpha * v.y, v.z});
  const double across = std::hypot(stretched.x, stretched.y);
  const Vec3 e0 = across > 0 ? Vec3{-stretched.y / across, stretched.x / across, 0} : Vec3{1, 0, 0};
  const Vec3 e1 = cross(stretched, e0);
  const Vec2 at = point_of_circle(xi.y);
  const double radius = std::sqrt(xi.x), x = radius * at.x, lift = (1 + stretched.z) / 2;
  const double y = (1 - lift) * std::sqrt(std::max(0.0, 1 - x * x)) + lift * radius * at.y;
  const Vec3 h = e0 * x + e1 * y + stretched * std::sqrt(std::max(0.0, 1 - x * x - y * y));
  return normalize({alpha * h.x, alpha * h.y, std::max(h.z, 0.0)});
}

/// G over the masking of the view alone: the weight of a direction that visible_facet() leads to.
double remaining_masking(double to_light, double to_eye, double alpha) {
  const double eye = masking_root(to_eye, alpha), light = masking_root(to_light, alpha);
  return to_light * (to_eye + eye) / (to_eye * light + to_light * eye);
}

/// Albedos by the root of the cosine and by roughness, and their means over all directions.
class AlbedoTable {
 public:
  AlbedoTable() {
    for (std::size_t row = 0; row < size; ++row) {
      const double alpha = alpha_of(static_cast<double>(row) / (size - 1));
      for (std::size_t i = 0; i < size; ++i) {
        const double root = static_cast<double>(i) / (size - 1);
        at_[row][i] = integrate(std::max(root * root, 1e-4), alpha);
      }
      constexpr int steps = 256;  // over the root: 2 c dc = 4 root^3 droot
      for (int i = 0; i < steps; ++i) {
        const double root = (i + 0.5) / steps, weight = 4 * root * root * root / steps;
        const FacetAlbedo here = find(at_[row], root);
        mean_[row].normal += weight * here.normal;
        mean_[row].grazing += weight * here.grazing;
      }
    }
  }

  [[nodiscard]] FacetAlbedo find(double cosine, double alpha) const {
    const auto [row, part] = place(std::sqrt(alpha));
    const double root = std::sqrt(std::clamp(cosine, 0.0, 1.0));
    return mixed(find(at_[row], root), find(at_[row + 1], root), part);
  }
  [[nodiscard]] FacetAlbedo mean(double alpha) const {
    const auto [row, part] = place(std::sqrt(alpha));
    return mixed(mean_[row], mean_[row + 1], part);
  }

 private:
  static constexpr std::size_t size = 32;
  using Row = std::array<FacetAlbedo, size>;

  static double alpha_of(double roughness) { return std::max(roughness * roughness, 1e-6); }
  static FacetAlbedo mixed(const FacetAlbedo& a, const FacetAlbedo& b, double t) {
    return {std::lerp(a.normal, b.normal, t), std::lerp(a.grazing, b.grazing, t)};
  }
  static std::pair<std::size_t, double> place(double x) {
    const double cell = std::clamp(x, 0.0, 1.0) * (size - 1);
    const auto first = std::min(static_cast<std::size_t>(cell), size - 2);
    return {first, cell - static_cast<double>(first)};
  }
  static FacetAlbedo find(const Row& row, double root) {
    const auto [first, part] = place(root);
    return mixed(row[first], row[first + 1], part);
  }

  static FacetAlbedo integrate(double cosine, double alpha) {
    constexpr std::uint32_t count = 1024;
    const Vec3 eye{std::sqrt(1 - cosine * cosine), 0, cosine};
    FacetAlbedo sum;
    for (std::uint32_t i = 0; i < count; ++i) {
      // No two at one distance from the view (Hammersley): for some widths a ring of a grid's points leaves at once.
      const Vec3 h = visible_facet(eye, alpha, {(i + 0.5) / count, reverse_bits(i) * 0x1p-32});
      const double between = dot(eye, h), to_light = 2 * between * h.z - eye.z;
      if (!(to_light > 0)) continue;
      const double weight = remaining_masking(to_light, cosine, alpha);
      const FacetAlbedo facet = schlick(between);
      sum.normal += weight * facet.normal;
      sum.grazing += weight * facet.grazing;
    }
    return {sum.normal / count, sum.grazing / count};
  }

  std::array<Row, size> at_{};
  Row mean_{};
};

/// Computed once, in some hundredths of a second, by the first scene with such a material.
const AlbedoTable& albedos() {
  static const AlbedoTable table;
  return table;
}

/// D G / (4 c_o) of facets, times pi, for unit vectors on the side of the normal, and the cosine of both to the facet.
std::pair<double, double> facets(const Vec3& normal, const Vec3& to_eye, const Vec3& to_light, double alpha) {
  const double light = dot(normal, to_light), eye = std::max(dot(normal, to_eye), 1e-6);
  const Vec3 h = normalize(to_light + to_eye), across = cross(normal, h);
  const double d = distribution(dot(normal, h), dot(across, across), alpha);
  const double masking = light / (2 * (eye * masking_root(light, alpha) + light * masking_root(eye, alpha)));
  return {std::numbers::pi * d * masking, dot(to_eye, h)};
}

constexpr double coat_f0 = 0.04;  // of the index 1.5

double reflected_by_coat(const FacetAlbedo& albedo) { return coat_f0 * albedo.normal + albedo.grazing; }

template <class OfChannel>
Color by_channel(const OfChannel& of) {
  return {of(&Color::r), of(&Color::g), of(&Color::b)};
}

}  // namespace

PrincipledPoint::PrincipledPoint(const PrincipledSurface& surface, const Vec3& normal, const Vec3& to_eye)
    : surface_(surface),
      normal_(normal),
      to_eye_(to_eye),
      cosine_(std::clamp(dot(normal, to_eye), 1e-6, 1.0)),
      view_(albedos().find(cosine_, surface.alpha)) {
  FacetAlbedo mean = albedos().mean(surface.alpha);
  const double lost = surface.alpha < PrincipledSurface::smooth_alpha ? 0 : 1 - mean.white(),
               metallic = surface.metallic;
  if (lost > 0) {
    const auto several = [&](double f0, double f90) {
      const double average = (20 * f0 + f90) / 21;  // of F over all directions
      return average * average * mean.white() / (1 - average * lost);
    };
    several_ = by_channel([&](double Color::*c) { return several(surface.f0.*c, surface.f90); });
    several_mixed_ = by_channel([&](double Color::*c) {
      return surface.glossy * std::lerp(several_.*c, several(surface.metal.*c, 1), metallic);
    });
  }
  passed_ = through_coat(cosine_);
  Color average = below_facets(mean);
  double average_lost = lost;
  if (surface.coat > 0) {  // means of products with 1 - S_c
    average = {};
    average_lost = 0;
    constexpr int steps = 8;
    for (int i = 0; i < steps; ++i) {
      const double cosine = (i + 0.5) / steps, weight = 2 * cosine / steps * through_coat(cosine);
      const FacetAlbedo there = albedos().find(cosine, surface.alpha);
      average += below_facets(there) * weight;
      average_lost += (1 - there.white()) * weight;
    }
    const double of_coat = 1 - passed_, below = passed_ * max_component(tint(view_)) * surface.glossy;
    coat_choice_ = of_coat / (of_coat + below);
  }
  if (lost > 0) several_factor_ = several_mixed_ * (passed_ * (1 - view_.white()) / average_lost);
  const Color seen = below_facets(view_);
  base_factor_ = by_channel([&](double Color::*c) {
    return passed_ * (1 - metallic) * surface.base.*c * seen.*c / std::max(average.*c, 1e-3);  // 0 over 0 where f0 is 1
  });
}

double PrincipledPoint::through_coat(double cosine) const {
  if (surface_.coat == 0) return 1;
  return 1 - surface_.coat * reflected_by_coat(albedos().find(cosine, surface_.coat_alpha));
}

Color PrincipledPoint::glossy_albedo() const {
  const double coat = 1 - passed_;
  return tint(view_) * (passed_ * surface_.glossy) + Color{coat, coat, coat};
}

/// Reflectance of the facets at once.
Color PrincipledPoint::tint(const FacetAlbedo& albedo) const {
  const double m = surface_.metallic, grazing = std::lerp(surface_.f90, 1.0, m) * albedo.grazing;
  return by_channel(
      [&](double Color::*c) { return std::lerp(surface_.f0.*c, surface_.metal.*c, m) * albedo.normal + grazing; });
}

Color PrincipledPoint::below_facets(const FacetAlbedo& albedo) const {
  return by_channel([&](double Color::*c) {
    return 1 - (surface_.f0.*c * albedo.normal + surface_.f90 * albedo.grazing + several_.*c * (1 - albedo.white()));
  });
}

Color PrincipledPoint::matt(double cosine) const {
  const FacetAlbedo light = albedos().find(cosine, surface_.alpha);
  return (base_factor_ * below_facets(light) + several_factor_ * (1 - light.white())) * through_coat(cosine);
}

Color PrincipledPoint::matt_albedo() const {
  return (surface_.base * below_facets(view_) * (1 - surface_.metallic) + several_mixed_ * (1 - view_.white())) *
         passed_;
}

Color PrincipledPoint::glossy(const Vec3& to_light, double least) const {
  const double cosine = dot(normal_, to_light);
  Color sum{};
  if (!(cosine > 0)) return sum;
  if (const double alpha = std::max(surface_.alpha, least); !is_smooth(alpha) || least > 0) {
    const auto [value, between] = facets(normal_, to_eye_, to_light, alpha);
    const double share = least > 0 ? 1 : surface_.glossy;
    sum = tint(schlick(between)) * (value * share * std::min(passed_, through_coat(cosine)));
  }
  if (const double alpha = std::max(surface_.coat_alpha, least);
      surface_.coat > 0 && (!is_smooth(alpha) || least > 0)) {
    const auto [value, between] = facets(normal_, to_eye_, to_light, alpha);
    const double coat = surface_.coat * reflected_by_coat(schlick(between)) * value;
    sum += Color{coat, coat, coat};
  }
  return sum;
}

Color PrincipledPoint::lit(const Vec3& to_light) const {
  const double cosine = dot(normal_, to_light);
  if (!(cosine > 0)) return {};
  return matt(cosine) * cosine + glossy(to_light, surface_.highlight);
}

Vec3 PrincipledPoint::sample_facet(const Vec2& xi, double alpha) const {
  if (is_smooth(alpha)) return normal_;
  const Axes axes = axes_about(normal_);
  const Vec3 h = visible_facet({dot(to_eye_, axes.e0), dot(to_eye_, axes.e1), cosine_}, alpha, xi);
  return unit(axes.e0 * h.x + axes.e1 * h.y + axes.n * h.z);
}

PrincipledPoint::Sample PrincipledPoint::sample(const Vec2& xi) const {
  const bool coat = xi.x < coat_choice_;
  const double probability = coat ? coat_choice_ : 1 - coat_choice_;
  const double alpha = coat ? surface_.coat_alpha : surface_.alpha;
  const Vec2 rest{std::min((coat ? xi.x : xi.x - coat_choice_) / probability, 0x1.fffffffffffffp-1), xi.y};
  const Vec3 direction = unit(reflected(-to_eye_, sample_facet(rest, alpha)));
  if (is_smooth(alpha)) {
    const FacetAlbedo facet =
        alpha < PrincipledSurface::smooth_alpha ? schlick(cosine_) : albedos().find(cosine_, alpha);
    const double of_coat = surface_.coat * reflected_by_coat(facet) / probability;
    return {direction,
            coat ? Color{of_coat, of_coat, of_coat} : tint(facet) * (surface_.glossy * passed_ / probability)};
  }
  const double there = density(direction);
  if (!(there > 0)) return {direction, {}};
  return {direction, glossy(direction) * (1 / (std::numbers::pi * there)), there};
}

double PrincipledPoint::density(const Vec3& direction) const {
  if (!(dot(normal_, direction) > 0)) return 0;
  const Vec3 h = normalize(direction + to_eye_), across = cross(normal_, h);
  const auto of = [&](double alpha) {  // masking of the view times D, over 4 c_o
    return is_smooth(alpha) ? 0
                            : distribution(dot(normal_, h), dot(across, across), alpha) /
                                  (2 * (cosine_ + masking_root(cosine_, alpha)));
  };
  return (1 - coat_choice_) * of(surface_.alpha) + (coat_choice_ > 0 ? coat_choice_ * of(surface_.coat_alpha) : 0);
}

}  // namespace tracer
