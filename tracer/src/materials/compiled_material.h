#pragma once
/// Material coefficients that are constant over the scene, computed once by compile(), and the specular terms of the
/// local illumination models.

#include <cmath>
#include <vector>

#include "tracer/src/math/lanes.h"
#include "tracer/src/math/vec.h"

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

/// Coefficients of a material with color C.
inline Color emitted_ambient(const Material& material, const Color& color, const Color& ambient) {
  return material.emission + ambient * color * (material.ambient * opaque_share(material));
}
inline Color diffuse_coefficient(const Material& material, const Color& color) {
  return color * (material.diffuse * opaque_share(material));
}

/// If the color is a texture, `own` and `diffuse` are those of black.
struct CompiledMaterial {
  Color own;       ///< emission and ambient term
  Color diffuse;   ///< factor of N.L
  Color specular;  ///< factor of the specular term; black: none
  Color mirror;    ///< reflectance K_r C_r, before the Fresnel factor
  Color through;   ///< transmittance K_t C_t, before the Fresnel factor
  double shininess = 0;
  double ior = 1;
  bool blinn = false;           ///< specular model of Blinn, else of Phong
  bool refracts = false;        ///< transmission by Snell's law
  bool fresnel = false;         ///< reflectance and transmittance are multiplied by the Fresnel factors
  bool textured = false;        ///< the color is a texture
  bool has_normal_map = false;  ///< a normal map or bump map perturbs the normals
  bool transmits = false;
  Material::Shading shading = Material::Shading::smooth;
};

inline CompiledMaterial compiled_materials(const Material& material, const Color& ambient) {
  const auto* plain = std::get_if<Color>(&material.color);
  const Color color = plain != nullptr ? *plain : Color{};
  const bool has_specular = material.model != Material::Model::lambert && material.specular > 0;
  const bool transmits = material.transmission > 0;
  return {.own = emitted_ambient(material, color, ambient),
          .diffuse = diffuse_coefficient(material, color),
          .specular = has_specular ? material.specular_color * material.specular : Color{},
          .mirror = material.reflection_color * material.reflection,
          .through = material.transmission_color * material.transmission,
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
