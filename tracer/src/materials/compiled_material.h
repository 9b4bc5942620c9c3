#pragma once
/// Material coefficients that are constant over the scene, computed once by compile(), the light that a surface gives
/// back, and the specular terms of the local illumination models.

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tracer/src/materials/principled.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/math/vec.h"
#include "tracer/validate.h"

namespace tracer {

/// Factor of the ambient and diffuse terms: 1 - K_t for interpolated transparency, else 1.
inline double opaque_share(const Material& material) {
  return material.transparency == Material::Transparency::interpolated ? 1 - material.transmission : 1;
}

/// Shading mode of a surface.
inline Material::Shading shading_of(Material::Shading own, Approximations::Shading approximate) {
  switch (approximate) {
    case Approximations::Shading::gouraud:
      return Material::Shading::gouraud;
    case Approximations::Shading::flat:
      return Material::Shading::flat;
    case Approximations::Shading::exact:
      break;
  }
  return own;
}

inline bool has_face_normals(Material::Shading shading) {
  return shading == Material::Shading::flat || shading == Material::Shading::flat_polygon;
}

/// True if triangles are lit at their vertices or centroids instead of the hit.
inline bool is_lit_by_triangle(Material::Shading shading) {
  return shading == Material::Shading::gouraud || shading == Material::Shading::flat_polygon;
}

/// True if it has a power of a cosine for a highlight.
inline bool has_specular(const Material& material) {
  return material.model != Material::Model::lambert && !is_principled(material) && material.specular > 0;
}

inline bool has_specular_transmission(const Material& material) {
  return material.model != Material::Model::lambert && !is_principled(material) && material.specular_transmission > 0;
}

/// True if lights on the far side of the surface brighten it.
inline bool transmits_light(const Material& material) {
  return material.diffuse_transmission > 0 || has_specular_transmission(material);
}

inline bool may_be_bright(const ColorOrTexture& color) {
  const auto* plain = std::get_if<Color>(&color);
  return plain == nullptr || max_component(*plain) > 0;
}

/// True if the surface scatters light to one of its sides.
inline bool scatters_light(const Material& material) {
  return is_principled(material) || (material.diffuse > 0 && may_be_bright(material.color)) ||
         (material.diffuse_transmission > 0 && may_be_bright(material.diffuse_transmission_color));
}

/// True if a part of the surface may be missing.
inline bool is_cut_out(const Material& material) {
  const auto* plain = std::get_if<Color>(&material.opacity);
  return plain == nullptr || !(*plain == Color{1, 1, 1});
}

/// True if light passes the surface: shadow rays do not end there.
inline bool lets_light_pass(const Material& material) { return material.transmission > 0 || is_cut_out(material); }

/// Factors of light at a point, before the Fresnel factors.
struct Coefficients {
  Color emitted_ambient;        ///< emission and ambient term
  Color diffuse;                ///< factor of N.L
  Color specular;               ///< factor of the specular term; black: none
  Color diffuse_transmission;   ///< factor of |N.L| for lights on the far side
  Color specular_transmission;  ///< factor of their specular term
  Color reflectance;            ///< K_r C_r
  Color transmittance;          ///< K_t C_t, and the share of the surface that is missing

  [[nodiscard]] Color scattered() const { return diffuse + diffuse_transmission; }     ///< to either side
  [[nodiscard]] Color highlights() const { return specular + specular_transmission; }  ///< on either side
};

/// Share of the surface that is there.
template <class ColorOf>
Color opacity(const Material& material, const ColorOf& color_of) {
  const auto within = [cutoff = material.opacity_cutoff](double share) {
    if (cutoff > 0) return share >= cutoff ? 1.0 : 0.0;
    return share > 0 ? std::min(share, 1.0) : 0.0;
  };
  const Color at_point = color_of(material.opacity);
  return {within(at_point.r), within(at_point.g), within(at_point.b)};
}

/// Transmittance at a point; see coefficients().
template <class ColorOf>
Color transmittance(const Material& material, const ColorOf& color_of) {
  Color surface{};
  if (material.transmission > 0) surface = color_of(material.transmission_color) * material.transmission;
  if (material.transmission > 0 && is_principled(material))
    surface = surface * color_of(material.color) * (1 - share(material.metallic, color_of));
  if (!is_cut_out(material)) return surface;
  const Color there = opacity(material, color_of);
  return surface * there + Color{1 - there.r, 1 - there.g, 1 - there.b};
}

/// Emission and ambient term, before the opacity.
inline Color emitted_ambient(const Material& material, const Color& emission, const Color& color,
                             const Color& ambient) {
  return emission + ambient * color * (material.ambient * opaque_share(material));
}

/// Factor of N.L, before the opacity.
inline Color diffuse_coefficient(const Material& material, const Color& color) {
  return color * (material.diffuse * opaque_share(material));
}

/// `color_of` returns the color of a ColorOrTexture at the point. It is called for the colors that have an effect only.
template <class ColorOf>
Coefficients coefficients(const Material& material, const Color& ambient, const ColorOf& color_of) {
  const Color color = color_of(material.color);
  Coefficients surface{
      .emitted_ambient = emitted_ambient(material, color_of(material.emission), color, ambient),
      .diffuse = diffuse_coefficient(material, color),
      .specular = has_specular(material) ? color_of(material.specular_color) * material.specular : Color{},
      .diffuse_transmission = material.diffuse_transmission > 0
                                  ? color_of(material.diffuse_transmission_color) * material.diffuse_transmission
                                  : Color{},
      .specular_transmission = has_specular_transmission(material)
                                   ? color_of(material.specular_color) * material.specular_transmission
                                   : Color{},
      .reflectance = material.reflection > 0 ? color_of(material.reflection_color) * material.reflection : Color{},
      .transmittance = transmittance(material, color_of)};
  if (is_principled(material)) {  // without the facets, which depend on the view
    const double matt = (1 - clear_share(material, color_of)) * (1 - share(material.metallic, color_of));
    surface.emitted_ambient = color_of(material.emission) + ambient * color * (material.ambient * matt);
    surface.diffuse = color * (matt * (1 - material.diffuse_transmission));
    surface.diffuse_transmission = surface.diffuse_transmission * matt;
    const double clear = 1 - share(material.metallic, color_of);
    if (material.reflection > 0) surface.reflectance = Color{clear, clear, clear} * clear_share(material, color_of);
  }
  if (!is_cut_out(material)) return surface;
  const Color there = opacity(material, color_of);
  for (Color Coefficients::*factor :
       {&Coefficients::emitted_ambient, &Coefficients::diffuse, &Coefficients::specular,
        &Coefficients::diffuse_transmission, &Coefficients::specular_transmission, &Coefficients::reflectance})
    surface.*factor = surface.*factor * there;
  return surface;
}

/// Upper bounds of coefficients(). `bound_of` returns an upper bound of a ColorOrTexture.
template <class BoundOf>
Coefficients coefficient_bounds(const Material& material, const Color& ambient, const BoundOf& bound_of) {
  if (!is_principled(material) || std::holds_alternative<Color>(material.metallic))
    return coefficients(material, ambient, bound_of);
  Material matt = material;  // metals scatter less than nonmetals
  matt.metallic = Color{};
  return coefficients(matt, ambient, bound_of);
}

// ---- Light that a surface gives back. Under the rendering equation it must not exceed what it receives: light between
// such surfaces would grow without end.

/// Upper bound, by channel, of the share of the arriving light that the surface sends on, highlights of lights left
/// out. `bound_of` returns an upper bound of a ColorOrTexture.
template <class BoundOf>
Color returned_share(const Material& material, const BoundOf& bound_of) {
  const Coefficients most = coefficient_bounds(material, {}, bound_of);
  if (is_principled(material)) {
    const Color base = bound_of(material.color);
    return {std::max(base.r, 1.0), std::max(base.g, 1.0), std::max(base.b, 1.0)};
  }
  const Color &reflected = most.reflectance, &transmitted = most.transmittance;
  // Fresnel's reflectance and transmittance add up to one.
  const Color diffuse = most.scattered();
  if (!material.fresnel) return diffuse + reflected + transmitted;
  return diffuse + Color{std::max(reflected.r, transmitted.r), std::max(reflected.g, transmitted.g),
                         std::max(reflected.b, transmitted.b)};
}

/// The sentence for a surface that gives back more light than it receives; none if it does not.
template <class BoundOf>
std::optional<std::string> excess_of_light(const Material& material, const BoundOf& bound_of) {
  constexpr double rounding = 0x1p-40;
  const Color share = returned_share(material, bound_of);
  const double most = max_component(share);
  if (!(most > 1 + rounding)) return std::nullopt;
  std::string parts;
  for (const auto& [name, factor] :
       {std::pair{"diffuse ", material.diffuse * opaque_share(material)},
        std::pair{"diffuse_transmission ", material.diffuse_transmission},
        std::pair{"reflection ", material.reflection}, std::pair{"transmission ", material.transmission}})
    if (factor > 0) parts += (parts.empty() ? "" : " + ") + (name + text_of(factor, 4));
  const char* const channel = most == share.r ? "red" : most == share.g ? "green" : "blue";
  return "gives back " + text_of(most, 4) + " of the light that it receives (" + parts + ", " + channel +
         "): must be <= 1 where /accuracy/model is global";
}

/// Calls visit(texture) for the textures of the colors that have an effect.
template <class Visit>
void for_each_color_texture(const Material& material, const Visit& visit) {
  const auto visit_color = [&](const ColorOrTexture& color) {
    if (const auto* texture = std::get_if<TextureId>(&color)) visit(*texture);
    return Color{};
  };
  coefficients(material, {}, visit_color);
  if (is_principled(material)) principled_surface(material, visit_color);
}

/// The coefficients of textured colors are those of white: `specular` and `reflectance` are black only if they are
/// black everywhere.
struct CompiledMaterial : Coefficients {
  double shininess = 0;
  double ior = 1;
  bool principled = false;           ///< PrincipledSurface is its reflection
  bool blinn = false;                ///< specular model of Blinn, else of Phong
  bool refracts = false;             ///< transmission by Snell's law
  bool fresnel = false;              ///< reflectance and transmittance are multiplied by the Fresnel factors
  bool textured = false;             ///< a color is a texture
  bool only_color_textured = false;  ///< it is `color` alone, on a surface without holes
  bool has_normal_map = false;       ///< a normal map or bump map perturbs the normals
  bool transmits = false;            ///< K_t > 0
  bool transmits_light = false;      ///< transmits_light()
  bool cut_out = false;              ///< is_cut_out()
  bool splits = false;               ///< lets light pass, or splits it by Fresnel's equations
  Material::Shading shading = Material::Shading::smooth;
};

inline CompiledMaterial compiled_material(const Material& material, const Color& ambient) {
  CompiledMaterial compiled;
  static_cast<Coefficients&>(compiled) = coefficients(material, ambient, [&](const ColorOrTexture& color) {
    const auto* plain = std::get_if<Color>(&color);
    return plain != nullptr ? *plain : Color{1, 1, 1};
  });
  std::size_t textures = 0;
  for_each_color_texture(material, [&](TextureId) { ++textures; });
  compiled.principled = is_principled(material);
  compiled.textured = textures > 0;
  compiled.only_color_textured = textures == 1 && !compiled.principled &&
                                 std::holds_alternative<TextureId>(material.color) && !is_cut_out(material);
  compiled.transmits = material.transmission > 0;
  compiled.transmits_light = transmits_light(material);
  compiled.cut_out = is_cut_out(material);
  compiled.shininess = material.shininess;
  compiled.ior = material.ior;
  compiled.blinn = material.model == Material::Model::blinn_phong;
  compiled.refracts = compiled.transmits && material.transparency == Material::Transparency::refract;
  compiled.fresnel = material.fresnel && (compiled.transmits || material.reflection > 0);
  compiled.splits = lets_light_pass(material) || compiled.fresnel;
  compiled.has_normal_map = material.bump || material.normal_map;
  compiled.shading = material.shading;
  return compiled;
}

inline std::vector<CompiledMaterial> compiled_materials(const std::vector<Material>& materials, const Color& ambient) {
  std::vector<CompiledMaterial> terms;
  terms.reserve(materials.size());
  for (const Material& material : materials) terms.push_back(compiled_material(material, ambient));
  return terms;
}

/// True if light at the far side of a surface is totally reflected there. `cosine`: of its direction and the normal of
/// that side. `eta`: index of refraction there over that on the near side.
WHITTLE_INLINE bool is_totally_reflected(double cosine, double eta) {
  return !((1 - eta * eta) + eta * eta * (cosine * cosine) > 0);
}

/// Base of the specular power of such light: t.v for the unit direction t that light from the unit direction l has
/// after it is refracted to the near side, and the unit direction v to the eye. n: normal of the far side, n.l > 0.
/// Precondition: it is not totally reflected.
WHITTLE_INLINE double transmitted_cosine(const Vec3& n, const Vec3& l, const Vec3& v, double eta) {
  const double cosine = n.x * l.x + n.y * l.y + n.z * l.z;
  const double straight = l.x * v.x + l.y * v.y + l.z * v.z, along = n.x * v.x + n.y * v.y + n.z * v.z;
  const double refracted = std::sqrt((1 - eta * eta) + eta * eta * (cosine * cosine));
  return -eta * straight - (refracted - eta * cosine) * along;
}

/// Base of the specular power (math/power.h) at unit normal n, unit directions l to the light and v to the eye, n.l >
/// 0; not clamped. phong: r.v with r = 2(n.l)n - l (Phong 1975). blinn_phong: n.h with h = (l+v)/|l+v| (Blinn 1977), 0
/// if l = -v.
WHITTLE_INLINE double phong_cosine(const Vec3& n, const Vec3& l, const Vec3& v) {
  const double twice = 2 * (n.x * l.x + n.y * l.y + n.z * l.z);
  return (n.x * twice - l.x) * v.x + (n.y * twice - l.y) * v.y + (n.z * twice - l.z) * v.z;
}
WHITTLE_INLINE double blinn_cosine(const Vec3& n, const Vec3& l, const Vec3& v) {
  const double x = l.x + v.x, y = l.y + v.y, z = l.z + v.z;
  const double length = std::sqrt(x * x + y * y + z * z);
  const double cosine = (n.x * x + n.y * y + n.z * z) / length;
  return length > 0 ? cosine : 0;
}

}  // namespace tracer
