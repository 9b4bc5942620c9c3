#pragma once
/// Textures and materials of a scene document. Each lists its fields; tracer/src/textures and tracer/src/materials
/// implement them.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>

#include "tracer/document_fields.h"
#include "tracer/values.h"

namespace tracer {

/// Unit squares of the transformed coordinates: colors[0] where floor(u) + floor(v) is even.
struct CheckerTexture {
  std::array<Color, 2> colors{};

  static constexpr auto fields() { return std::tuple{Field{"checker", &CheckerTexture::colors}}; }
};

/// From colors[0] at v = 0 to colors[1] at v = 1, linearly.
struct GradientTexture {
  std::array<Color, 2> colors{};

  static constexpr auto fields() { return std::tuple{Field{"gradient", &GradientTexture::colors}}; }
};

/// Gradient noise n(u, v) in [-1, 1] with a cell of one unit (Perlin 2002): from colors[0] at -1 to colors[1] at 1. Sum
/// of `octaves`, each with twice the frequency and half the amplitude of the previous one, divided by the root of the
/// sum of their squares, so that the contrast does not depend on their number, and clamped.
struct NoiseTexture {
  std::array<Color, 2> colors{};
  std::uint32_t octaves = 1;  ///< up to Limits::octaves

  static constexpr auto fields() {
    return std::tuple{Field{"noise", &NoiseTexture::colors},
                      optional_field("octaves", &NoiseTexture::octaves, FieldRange::count())};
  }
};

enum class ColorSpace { srgb, linear };
constexpr auto words_of(ColorSpace first) { return in_order(first, {"srgb", "linear"}); }

/// An image file over the unit square: v = 0 is the lower edge of its bottom row. The first three channels are red,
/// green and blue; one or two channels are gray (and alpha).
struct ImageTexture {
  AssetId file{};
  std::optional<ColorSpace> color_space;  ///< unset: sRGB for PNG and JPEG, linear for OpenEXR and Radiance HDR
  /// color: without alpha. alpha: the last of two or four channels, as gray and linear; a file without it fails with
  /// `bad_asset`. red, green, blue: that channel as gray. luminance: that of ITU-R BT.709, as gray.
  enum class Channel { color, alpha, red, green, blue, luminance };
  Channel channel = Channel::color;
  std::optional<std::uint32_t> image{};  ///< index of an image within a glTF file; api/load_assets.h extracts it

  static constexpr auto fields() {
    return std::tuple{Field{"file", &ImageTexture::file}, optional_field("channel", &ImageTexture::channel),
                      Field{"image", &ImageTexture::image}, Field{"color_space", &ImageTexture::color_space}};
  }
};
constexpr auto words_of(ImageTexture::Channel first) {
  return in_order(first, {"color", "alpha", "red", "green", "blue", "luminance"});
}

/// A pattern evaluated at (u scale.x + offset.x, v scale.y + offset.y).
struct Texture {
  std::variant<CheckerTexture, GradientTexture, NoiseTexture, ImageTexture> pattern{};
  Vec2 scale{1, 1};
  Vec2 offset{0, 0};
  std::string path;  ///< JSON pointer of its definition, e.g. "/textures/floor"; prefix of issue pointers
  /// Continuation of gradients and images beyond [0, 1]. No effect on checkers and noise.
  enum class Wrap { repeat, clamp, mirror };
  Wrap wrap = Wrap::repeat;
  /// nearest: the texel, or the pattern at the point. bilinear: between four texels; patterns as nearest. mipmap: the
  /// mean over the sample's footprint on the surface. A sample covers 1 / sqrt(samples) of its pixel's width, so the
  /// footprint shrinks with more samples and the converged image is unbiased.
  enum class Filter { nearest, bilinear, mipmap };
  Filter filter = Filter::mipmap;
  Color factor{1, 1, 1};  ///< multiplies the pattern's colors

  static constexpr auto fields() {
    return std::tuple{optional_field("scale", &Texture::scale), optional_field("offset", &Texture::offset),
                      optional_field("factor", &Texture::factor), optional_field("wrap", &Texture::wrap),
                      optional_field("filter", &Texture::filter)};
  }
};
constexpr auto words_of(Texture::Wrap first) { return in_order(first, {"repeat", "clamp", "mirror"}); }
constexpr auto words_of(Texture::Filter first) { return in_order(first, {"nearest", "bilinear", "mipmap"}); }

using ColorOrTexture = std::variant<Color, TextureId>;

/// Bump map (Blinn 1978, "Simulation of Wrinkled Surfaces"): perturbs normals, not the surface. The height above the
/// front is `scale`, in scene units, times the mean of the texture's linear red, green and blue.
struct Bump {
  TextureId texture{};
  double scale = 1;  ///< negative: inverted relief

  static constexpr std::string_view noun = "a bump";
  static constexpr auto fields() {
    return std::tuple{Field{"texture", &Bump::texture}, optional_field("scale", &Bump::scale, FieldRange::position)};
  }
};

/// Reflectance and transmittance of a surface (Whitted 1980; Phong 1975; Blinn 1977):
///   I_local = emission + K_a C I_a + sum_i f_i S_i I_i [ K_d C max(0,N.L) + K_s C_s spec ],  spec = 0 where N.L <= 0
///   I = I_local + K_r C_r I(reflected) + K_t C_t I(transmitted)
/// N is on the side of the ray: a back-face hit uses -N. Lights on the other side, where N.L < 0, add (Hall & Greenberg
/// 1983, "A Testbed for Realistic Image Synthesis")
///   sum_i f_i S_i I_i [ K_dt C_dt |N.L| + K_st C_s max(0,T.V)^n' ]
/// with the direction T of the light's ray after it is refracted at the point, from the index of refraction of the far
/// side to that of the near side (none at total internal reflection; straight on unless the material refracts), and
/// n' = n, or n/4 for blinn_phong, which has the same width. `lambert` has no K_st.
///
/// `principled`: metals, plastics and glass of any roughness by the quantities of glTF 2.0 (appendix B);
/// tracer/src/materials/principled.h has the formulas. `color` is the base color. Lights have highlights, reflected and
/// refracted rays are spread over the directions of rough facets, and the sum is what arrives at most.
struct Material {
  enum class Model { lambert, phong, blinn_phong, principled };
  Model model = Model::phong;
  ColorOrTexture color = Color{0.8, 0.8, 0.8};                 ///< C
  double ambient = 1;                                          ///< K_a
  double diffuse = 1;                                          ///< K_d
  double specular = 0;                                         ///< K_s
  double shininess = 32;                                       ///< n >= 0
  ColorOrTexture metallic = Color{};                           ///< principled: share in [0,1], the red channel
  ColorOrTexture roughness = Color{0.5, 0.5, 0.5};             ///< the same, of a distribution of width roughness^2
  ColorOrTexture coat = Color{};                               ///< principled: share of a clear coat of index 1.5
  ColorOrTexture coat_roughness = Color{};                     ///< that of the coat's facets
  ColorOrTexture specular_color = Color{1, 1, 1};              ///< C_s
  double diffuse_transmission = 0;                             ///< K_dt in [0,1]
  double specular_transmission = 0;                            ///< K_st
  ColorOrTexture diffuse_transmission_color = Color{1, 1, 1};  ///< C_dt
  ColorOrTexture emission = Color{};
  double reflection = 0;                             ///< K_r in [0,1]
  ColorOrTexture reflection_color = Color{1, 1, 1};  ///< C_r
  double transmission = 0;                           ///< K_t in [0,1]; filtered transparency may have more
  /// C_t. Shadow rays read a texture at the point where they cross the surface, without a footprint.
  ColorOrTexture transmission_color = Color{1, 1, 1};
  /// Transmission for K_t > 0. refract: Snell's law; total internal reflection adds K_t C_t to the reflected
  /// throughput. interpolated: not refracted, I = (1 - K_t)(ambient + diffuse) + specular + emission + K_t C_t
  /// I_behind. filtered: not refracted, I = I_local + K_t C_t I_behind. (Foley, van Dam et al. 1990, sec. 16.5.1.)
  enum class Transparency { refract, interpolated, filtered };
  Transparency transparency = Transparency::refract;
  /// Share of the surface that is there, by channel, in [0, 1]: I = opacity I_surface + (1 - opacity) I_behind, and
  /// shadow rays pass likewise. Below 1 only where the surface neither refracts nor has `fresnel`.
  ColorOrTexture opacity = Color{1, 1, 1};
  double opacity_cutoff = 0;  ///< above 0: shares from there on count as 1, others as 0
  double ior = 1.5;           ///< > 0; relative to the outside
  /// Nested dielectrics: the overlap of solids has the medium of the highest priority; among equals that of a closed
  /// object before an open one, then that of the object with the smaller bounding box, by its diagonal; then that of
  /// the later material.
  int priority = 0;
  Color absorption{};  ///< per scene unit: radiance is multiplied by exp(-absorption s) along a length s inside
  /// smooth: interpolated normals if the mesh has them. flat: face normals. gouraud: local shading is evaluated at the
  /// vertices of the mesh and interpolated, with highlights for an eye at the camera, or for an orthographic camera and
  /// after a bounce at infinity along the ray; on other shapes the same as smooth. Shadow rays of smooth front faces
  /// start at the surface that the normals suggest (Hanika 2021, "Hacking the Shadow Terminator"); lights are evaluated
  /// at the hit.
  /// flat_polygon: face normals, and local shading is evaluated once for each polygon, at its centroid, with
  /// highlights for the same eye as gouraud; on other shapes the same as smooth.
  enum class Shading { smooth, flat, gouraud, flat_polygon };
  Shading shading = Shading::smooth;
  /// Tangent-space normals: (red, green, blue) = n/2 + 1/2 with n.x along dp/du, n.y along dp/dv and n.z out of the
  /// front. An image without an explicit color space is linear here, for every format.
  std::optional<TextureId> normal_map{};
  double normal_scale = 1;     ///< factor of n.x and n.y
  std::optional<Bump> bump{};  ///< applied after the normal map
  /// K_r is multiplied by F and K_t by 1-F, F the exact unpolarized dielectric reflectance. The document's default is
  /// true if transmission > 0 is refracted; the reader resolves it, and reflection's default of 1 with fresnel.
  bool fresnel = false;
  std::string path;  ///< JSON pointer of its definition, e.g. "/materials/red"; prefix of issue pointers

  /// Fields that only the principled model has, and those that it does not have: an error elsewhere.
  static constexpr std::string_view principled_fields[] = {"metallic", "roughness", "coat", "coat_roughness"};
  static constexpr std::string_view local_fields[] = {"diffuse", "shininess",  "specular_transmission",
                                                      "fresnel", "reflection", "reflection_color"};

  static constexpr auto fields() {
    return std::tuple{optional_field("model", &Material::model),
                      optional_field("color", &Material::color),
                      optional_field("ambient", &Material::ambient, FieldRange::factor),
                      optional_field("diffuse", &Material::diffuse, FieldRange::factor),
                      Field{"specular", &Material::specular, FieldRange::factor, FieldPresence::derived},
                      optional_field("shininess", &Material::shininess, FieldRange::exponent),
                      optional_field("metallic", &Material::metallic),
                      optional_field("roughness", &Material::roughness),
                      optional_field("coat", &Material::coat),
                      optional_field("coat_roughness", &Material::coat_roughness),
                      optional_field("specular_color", &Material::specular_color),
                      optional_field("diffuse_transmission", &Material::diffuse_transmission, FieldRange::fraction()),
                      optional_field("diffuse_transmission_color", &Material::diffuse_transmission_color),
                      optional_field("specular_transmission", &Material::specular_transmission, FieldRange::factor),
                      optional_field("emission", &Material::emission),
                      optional_field("transparency", &Material::transparency),
                      optional_field("transmission", &Material::transmission, FieldRange::factor),
                      Field{"fresnel", &Material::fresnel, FieldRange::any, FieldPresence::derived},
                      Field{"reflection", &Material::reflection, FieldRange::fraction(), FieldPresence::derived},
                      optional_field("reflection_color", &Material::reflection_color),
                      optional_field("transmission_color", &Material::transmission_color),
                      optional_field("opacity", &Material::opacity),
                      optional_field("opacity_cutoff", &Material::opacity_cutoff, FieldRange::fraction()),
                      optional_field("ior", &Material::ior, FieldRange::ratio),
                      optional_field("priority", &Material::priority),
                      optional_field("absorption", &Material::absorption),
                      optional_field("shading", &Material::shading),
                      optional_field("normal_map", &Material::normal_map),
                      optional_field("normal_scale", &Material::normal_scale, FieldRange::position),
                      optional_field("bump", &Material::bump)};
  }
};
constexpr auto words_of(Material::Model first) {
  return in_order(first, {"lambert", "phong", "blinn_phong", "principled"});
}
constexpr auto words_of(Material::Transparency first) {
  return in_order(first, {"refract", "interpolated", "filtered"});
}
constexpr auto words_of(Material::Shading first) {
  return in_order(first, {"smooth", "flat", "gouraud", "flat_polygon"});
}

}  // namespace tracer
