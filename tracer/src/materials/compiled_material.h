#pragma once
/// What of a material's light is the same at every hit, worked out once a scene.

#include <vector>

#include "tracer/src/math/vec.h"

namespace tracer {

/// What is left of the ambient and diffuse light of a surface that interpolates it with what is behind.
inline double body(const Material& material) {
  return material.transparency == Material::Transparency::interpolated ? 1 - material.transmission : 1;
}

/// What a material of colour C gives by itself, and what it makes of light.
inline Color local_radiance_bound(const Material& material, const Color& color, const Color& ambient) {
  return material.emission + ambient * color * (material.ambient * body(material));
}
inline Color diffuse_share(const Material& material, const Color& color) {
  return color * (material.diffuse * body(material));
}

/// Where a texture is the colour, `own` and `diffuse` are those of black.
struct CompiledMaterial {
  Color own;       ///< emission and ambient light
  Color diffuse;   ///< what N.L is multiplied by
  Color specular;  ///< what the highlight is multiplied by; black: there is none
  Color mirror;    ///< K_r C_r: what goes on mirrored, before Fresnel's share
  Color through;   ///< what goes on through the surface, likewise: K_t C_t, or K_t where it interpolates
  double shininess = 0;
  double ior = 1;
  bool blinn = false;           ///< the highlight is Blinn's; else Phong's
  bool refracts = false;        ///< it bends what it lets through
  bool fresnel = false;         ///< Fresnel divides what goes on
  bool textured = false;        ///< its colour is a texture's
  bool has_normal_map = false;  ///< textures bend its normals
  bool transmits = false;       ///< it lets light through
  Material::Shading shading = Material::Shading::smooth;
};

inline CompiledMaterial compiled_materials(const Material& material, const Color& ambient) {
  const auto* plain = std::get_if<Color>(&material.color);
  const Color color = plain != nullptr ? *plain : Color{};
  const bool has_specular = material.model != Material::Model::lambert && material.specular > 0;
  const bool transmits = material.transmission > 0;
  const bool interpolates = material.transparency == Material::Transparency::interpolated;
  const Color through = Color{1, 1, 1} * material.transmission;
  return {.own = local_radiance_bound(material, color, ambient),
          .diffuse = diffuse_share(material, color),
          .specular = has_specular ? material.specular_color * material.specular : Color{},
          .mirror = material.reflection_color * material.reflection,
          .through = interpolates ? through : through * material.transmission_color,
          .shininess = material.shininess,
          .ior = material.ior,
          .blinn = material.model == Material::Model::blinn_phong,
          .refracts = transmits && material.transparency == Material::Transparency::refract,
          .fresnel = material.fresnel && (transmits || material.reflection > 0),
          .textured = plain == nullptr,
          .has_normal_map = material.bump || material.normal_map,
          .transmits = transmits,
          .shading = material.shading};
}

inline std::vector<CompiledMaterial> compiled_materials(const std::vector<Material>& materials, const Color& ambient) {
  std::vector<CompiledMaterial> terms;
  terms.reserve(materials.size());
  for (const Material& material : materials) terms.push_back(compiled_materials(material, ambient));
  return terms;
}

}  // namespace tracer
