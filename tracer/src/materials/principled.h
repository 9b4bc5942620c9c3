#pragma once
/// The principled material: its parameters at a point, evaluation, sampling, density and bounds.
///
/// A rough surface of facets reflects by the distribution GGX of their normals with width a = roughness^2 (Walter et
/// al. 2007, "Microfacet Models for Refraction through Rough Surfaces"), Smith's masking for correlated heights (Heitz
/// 2014, "Understanding the Masking-Shadowing Function", eq. 99), and Schlick's Fresnel term F = f0 + (f90 - f0) (1 -
/// v.h)^5. Below the facets is a matt base. With the albedo S(c) of the facets for light at the cosine c, its mean S'
/// over all directions and E of white facets, a nonmetal has
///   f = F D G / (4 c_o c_i) + f_m (1 - E(c_o)) (1 - E(c_i)) / (pi (1 - E')) + base (1 - S(c_o)) (1 - S(c_i)) / (pi (1
///   - S'))
/// which is reciprocal and reflects everything if the base is white. The second term is light that facets reflect
/// several times (Kulla & Conty 2017, "Revisiting Physically Based Shading at Imageworks"), f_m = F'^2 E' / (1 - F' (1
/// - E')). A metal has f0 = base and no matt part, and values between are mixtures of both. Glass transmits what its
/// facets do not reflect; a facet is selected by its visible area, and its interface is exact (math/optics.h). That
/// loses no energy, but rays that leave are not masked, so it is not reciprocal where it is rough.
///
/// A clear coat reflects the share S_c of its own facets, of f0 = 0.04. Light passes it twice: the matt part has the
/// factor (1 - S_c(c_o)) (1 - S_c(c_i)), with the mean of both layers in place of 1 - S', and the facets below have the
/// smaller of the two, so that white metal below a smooth coat reflects 0.947 of the light at least, and 0.971 in the
/// mean over directions; a white nonmetal 0.975 and 0.993.
///
/// All directions are unit vectors away from the surface; c_i and c_o are their cosines to the normal. Values of f are
/// multiplied by pi, as coefficients of the local models are, and by c_i.

#include <algorithm>

#include "tracer/src/math/vec.h"

namespace tracer {

/// Parameters at a point of the surface.
struct PrincipledSurface {
  /// Narrower surfaces are mirrors.
  static constexpr double smooth_alpha = 1e-3;
  /// Lights have the highlight of a surface of this width at least: that of a mirror would be a point.
  static constexpr double highlight_alpha = 0.04;
  /// The same where paths arrive by way of matt or of as rough surfaces, which blur it: their samples rarely find a
  /// narrow highlight (Kaplanyan & Dachsbacher 2013, "Path Space Regularization for Holistic and Robust Light
  /// Transport"). The energy is that of the narrow one.
  static constexpr double blurred_alpha = 0.25;
  /// Upper bound of the highlight for f0 = f90 = 1: D <= 1 / (pi a^2), and G / (4 c_o) <= 1 / (2 a).
  static constexpr double highlight_max = 1 / (2 * highlight_alpha * highlight_alpha * highlight_alpha);

  Color base{};                        ///< color of a nonmetal's matt part
  Color metal{};                       ///< f0 of the metal
  double metallic = 0;                 ///< share of the metal
  Color f0{};                          ///< reflectance of a nonmetal's facet at normal incidence, at most 1
  double f90 = 1;                      ///< and at grazing incidence
  double alpha = 1;                    ///< width of the distribution
  double coat = 0;                     ///< share that has a clear coat
  double coat_alpha = 0;               ///< width of the distribution of its facets
  double glossy = 1;                   ///< share of the facets that are no glass: glass reflects by its own rays
  Color sheet{};                       ///< share of the light below the facets that passes a thin sheet straight
  bool mirror = false;                 ///< reflects like a smooth surface
  double highlight = highlight_alpha;  ///< width of the distribution for lights
};

/// Albedos of facets with f0 = 1, f90 = 0 and with f0 = 0, f90 = 1. Their sum is that of white ones.
struct FacetAlbedo {
  double normal = 0, grazing = 0;
  [[nodiscard]] double white() const { return normal + grazing; }
};

/// A surface seen from one direction. Immutable; any thread.
class PrincipledPoint {
 public:
  PrincipledPoint() = default;
  /// `normal`: on the side of `to_eye`, with a positive product of both.
  PrincipledPoint(const PrincipledSurface& surface, const Vec3& normal, const Vec3& to_eye);

  [[nodiscard]] const PrincipledSurface& surface() const { return surface_; }
  /// True if no direction but that of a mirror has light of the facets, or of those of the coat.
  [[nodiscard]] bool is_smooth() const {
    return is_smooth(surface_.alpha) && (surface_.coat == 0 || is_smooth(surface_.coat_alpha));
  }

  /// Matt part and light of several reflections, for light from `cosine` > 0: over c_i, so constant for a matt surface.
  [[nodiscard]] Color matt(double cosine) const;
  /// Its mean over directions that are distributed as the cosine: the share of the light that it reflects.
  [[nodiscard]] Color matt_albedo() const;
  /// Share of the light that the facets reflect at once.
  [[nodiscard]] Color glossy_albedo() const;
  /// Facets, for light from `to_light` on the side of the normal, with distributions of width `least` or more.
  [[nodiscard]] Color glossy(const Vec3& to_light, double least = 0) const;
  /// Both, for a light.
  [[nodiscard]] Color lit(const Vec3& to_light) const;

  /// Normal of a visible facet for xi in [0,1)^2 (Heitz 2018, "Sampling the GGX Distribution of Visible Normals").
  [[nodiscard]] Vec3 sample_facet(const Vec2& xi) const { return sample_facet(xi, surface_.alpha); }
  /// A direction and what arrives from there: glossy() over density(). Black below the surface.
  struct Sample {
    Vec3 direction;
    Color factor;
    double density = 0;  ///< per solid angle; 0 for a mirror, which no other technique samples
  };
  [[nodiscard]] Sample sample(const Vec2& xi) const;
  /// Density of sample() in this direction.
  [[nodiscard]] double density(const Vec3& direction) const;

 private:
  [[nodiscard]] Color tint(const FacetAlbedo& albedo) const;
  [[nodiscard]] Color below_facets(const FacetAlbedo& albedo) const;  ///< 1 - S of a nonmetal
  [[nodiscard]] Vec3 sample_facet(const Vec2& xi, double alpha) const;
  [[nodiscard]] double through_coat(double cosine) const;  ///< 1 - S_c
  [[nodiscard]] bool is_smooth(double alpha) const {
    return surface_.mirror || alpha < PrincipledSurface::smooth_alpha;
  }

  PrincipledSurface surface_;
  Vec3 normal_{}, to_eye_{};
  double cosine_ = 1;       ///< c_o
  double passed_ = 1;       ///< 1 - S_c(c_o)
  double coat_choice_ = 0;  ///< probability of sampling the coat
  FacetAlbedo view_{};      ///< at c_o
  Color several_{};         ///< f_m of a nonmetal
  Color several_mixed_{};   ///< and of the mixture
  Color base_factor_{};     ///< base (1 - S(c_o)) / (1 - S')
  Color several_factor_{};  ///< f_m (1 - E(c_o)) / (1 - E')
};

// ---- the material of a document

inline bool is_principled(const Material& material) { return material.model == Material::Model::principled; }

/// The share of a color that a principled material has as a number.
template <class ColorOf>
double share(const ColorOrTexture& value, const ColorOf& color_of) {
  return std::clamp(color_of(value).r, 0.0, 1.0);
}

/// Share of the light below the facets of a principled surface that is transmitted.
template <class ColorOf>
double clear_share(const Material& material, const ColorOf& color_of) {
  if (!(material.transmission > 0)) return 0;
  return std::min(material.transmission * max_component(color_of(material.transmission_color)), 1.0);
}

/// A principled material at a point. Reflectance of nonmetals: ((n - 1) / (n + 1))^2 (Born & Wolf 1999, sec. 1.5.2).
template <class ColorOf>
PrincipledSurface principled_surface(const Material& material, const ColorOf& color_of) {
  const Color base = color_of(material.color), tint = color_of(material.specular_color);
  const double clear = clear_share(material, color_of), roughness = share(material.roughness, color_of);
  const double amplitude = (material.ior - 1) / (material.ior + 1), most = std::min(material.specular, 1.0);
  const auto reflectance = [&](double channel) { return std::min(most * channel * amplitude * amplitude, 1.0); };
  const bool refracts = material.transparency == Material::Transparency::refract;
  PrincipledSurface surface{.base = base * ((1 - clear) * (1 - material.diffuse_transmission)),
                            .metal = base,
                            .metallic = share(material.metallic, color_of),
                            .f0 = {reflectance(tint.r), reflectance(tint.g), reflectance(tint.b)},
                            .f90 = most,
                            .alpha = roughness * roughness};
  surface.coat = share(material.coat, color_of);
  surface.coat_alpha = std::pow(share(material.coat_roughness, color_of), 2);
  surface.glossy = refracts ? 1 - clear * (1 - surface.metallic) : 1;
  if (!refracts && clear > 0)
    surface.sheet = base * color_of(material.transmission_color) * (material.transmission * (1 - surface.metallic));
  return surface;
}

}  // namespace tracer
