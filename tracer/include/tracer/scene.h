#pragma once
/// A scene as plain values: the content of a scene document, with references resolved to handles.
///
/// Frame and units: right-handed world space, lengths in scene units, angles in degrees (suffix `_deg`), colors linear
/// RGB. Every default is the document's default. A Scene owns all its data and can be copied and moved. It may hold any
/// values; `validate` decides if it can be rendered.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/lights.h"
#include "tracer/shapes.h"
#include "tracer/values.h"

namespace tracer {

/// A file that the scene names. The caller supplies its bytes (Assets).
struct Asset {
  std::string name;  ///< as written in the document: "wood.png"
  std::string path;  ///< JSON pointer of its first use, e.g. "/textures/floor/file"
};

// ---- image, camera, background ------------------------------------------------------------------------------------

/// Half-open: columns [x0, x1) of rows [y0, y1).
struct PixelWindow {
  std::uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  [[nodiscard]] std::uint32_t width() const { return x0 < x1 ? x1 - x0 : 0; }
  [[nodiscard]] std::uint32_t height() const { return y0 < y1 ? y1 - y0 : 0; }
  [[nodiscard]] std::uint64_t pixels() const { return std::uint64_t{width()} * height(); }
  bool operator==(const PixelWindow&) const = default;
};

struct ImageSize {
  std::uint32_t width = 640, height = 480;  ///< pixels; row 0 is on top, pixel (x,y) covers [x,x+1) x [y,y+1)
  /// The part to render. With a fixed number of samples it is bit-identical to that part of the full image; adaptive
  /// samples depend on the window.
  std::optional<PixelWindow> crop{};

  /// The rendered part, and the size of the rendered image.
  [[nodiscard]] PixelWindow window() const { return crop.value_or(PixelWindow{0, 0, width, height}); }
};

struct Camera {
  Vec3 position{};
  Vec3 look_at{};  ///< at the center of the image
  Vec3 up{0, 1, 0};
  double fov_deg = 45;  ///< perspective: full vertical angle, 0 < fov_deg < 180
  /// perspective: rays from `position` through a window that spans `fov_deg`; pixels are square. orthographic: parallel
  /// rays from a window of `height` centered at `position`, forward only; pixels are square. panorama: equirectangular,
  /// 360 degrees across the image to the right and 180 down, for any aspect ratio.
  enum class Type { perspective, orthographic, panorama };
  Type type = Type::perspective;
  double height = 1;  ///< orthographic: height of the window, world; required in documents
  /// Diameter of a thin lens, world; 0 is a pinhole. The plane at `focus_distance` along the viewing axis is in focus;
  /// a panorama's lens is perpendicular to each ray, so the sphere of that radius is. With one sample per pixel all
  /// rays pass the center of the lens.
  double aperture = 0;
  std::optional<double> focus_distance{};  ///< unset: distance of `look_at`
  /// Two eyes at `eye_separation` from each other across the view, around `position`, with parallel axes. Their windows
  /// coincide at the focus distance: what is there has no parallax. The left eye decides which solids are around both.
  /// side_by_side: the left and right halves of the image are those of the left and right eye, for an even width.
  /// anaglyph: red is that of the left eye, green and blue are those of the right eye; a sample has a ray for each.
  enum class Layout { single, side_by_side, anaglyph };
  Layout layout = Layout::single;  ///< perspective and orthographic, without crop; anaglyph without layers or depth cue
  double eye_separation = 0;       ///< world, >= 0; without effect on a single eye
};

/// nadir for directions opposite to the background's `up`, zenith along it, linear in the cosine between.
struct Gradient {
  Color zenith{}, nadir{};
};

/// Equirectangular texture of all directions, as a panorama camera renders it: u = 1/2 is world -z projected across the
/// background's `up` (+x if up is along z) and grows to the right; v = 0 is straight down, 1 straight up. With a
/// texture scale of 1, u is periodic and v is clamped at the poles for every `wrap`.
struct Environment {
  TextureId texture{};
  double rotation_deg = 0;  ///< about up, counter-clockwise seen from the tip of up; any finite angle
};

/// One texture per face of a cube at infinity, seen from inside with u to the right and v up. On the side faces, up is
/// the world axis closest to the background's `up`; the top and bottom faces are oriented as seen by pitching up and
/// down from the -z face (+x if up is z). Order: +x, -x, +y, -y, +z, -z.
struct CubeMap {
  std::array<TextureId, 6> faces{};
};

/// Radiance of rays that hit nothing: `color`, or the one other member that is set.
struct Background {
  Color color{};
  std::optional<Gradient> gradient{};
  std::optional<Environment> environment{};
  std::optional<CubeMap> cube{};
  std::optional<Vec3> up{Vec3{0, 1, 0}};  ///< any length > 0; unset: the camera's, with which the sky turns
};

/// I' = S I + (1-S) color for the radiance I of a camera ray. S depends on the distance z of the hit along the viewing
/// axis (panorama: along the ray): front_scale up to `front`, back_scale beyond `back` and without a hit, linear
/// between; for front = back a step behind it. (Foley, van Dam et al. 1990, sec. 16.1.3.)
struct DepthCue {
  double front = 0, back = 0;              ///< world, front <= back
  double front_scale = 1, back_scale = 0;  ///< [0, 1]
  Color color{};
};

/// The medium outside of all solids.
struct Medium {
  Color absorption{};  ///< per scene unit, as that of a Material; light from infinitely far does not arrive through it
};

// ---- lights --------------------------------------------------------------------------------------------------------

/// f(d) for the distance d from light to surface. `none`: 1. `polynomial`: min(1/(c0 + c1 d + c2 d^2), 1), c_i >= 0
/// with a positive sum. `inverse_square`: 1/d^2, unclamped. (Foley, van Dam et al. 1990, eq. 16.8.)
struct Attenuation {
  enum class Kind { none, polynomial, inverse_square };
  Kind kind = Kind::none;
  std::array<double, 3> coefficients{1, 0, 0};
};

struct Light {
  LightSource source{};
  Color color{1, 1, 1};
  double intensity = 1;
  bool shadows = true;
  Attenuation attenuation{};  ///< ignored by directional lights (f = 1)
};

// ---- textures and materials ----------------------------------------------------------------------------------------

/// Unit squares of the transformed coordinates: colors[0] where floor(u) + floor(v) is even.
struct CheckerTexture {
  std::array<Color, 2> colors{};
};

/// From colors[0] at v = 0 to colors[1] at v = 1, linearly.
struct GradientTexture {
  std::array<Color, 2> colors{};
};

/// Gradient noise n(u, v) in [-1, 1] with a cell of one unit (Perlin 2002): from colors[0] at -1 to colors[1] at 1. Sum
/// of `octaves`, each with twice the frequency and half the amplitude of the previous one, divided by the root of the
/// sum of their squares, so that the contrast does not depend on their number, and clamped.
struct NoiseTexture {
  std::array<Color, 2> colors{};
  std::uint32_t octaves = 1;  ///< 1..32
};

enum class ColorSpace { linear, srgb };

/// An image file over the unit square: v = 0 is the lower edge of its bottom row. The first three channels are red,
/// green and blue; one or two channels are gray (and alpha).
struct ImageTexture {
  AssetId file{};
  std::optional<ColorSpace> color_space;  ///< unset: sRGB for PNG and JPEG, linear for OpenEXR and Radiance HDR
  /// color: without alpha. alpha: the last of two or four channels, as gray and linear; a file without it fails with
  /// `bad_asset`.
  enum class Channel { color, alpha };
  Channel channel = Channel::color;
};

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
};

using ColorOrTexture = std::variant<Color, TextureId>;

/// Bump map (Blinn 1978, "Simulation of Wrinkled Surfaces"): perturbs normals, not the surface. The height above the
/// front is `scale`, in scene units, times the mean of the texture's linear red, green and blue.
struct Bump {
  TextureId texture{};
  double scale = 1;  ///< negative: inverted relief
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
struct Material {
  enum class Model { lambert, phong, blinn_phong };
  Model model = Model::phong;
  ColorOrTexture color = Color{0.8, 0.8, 0.8};                 ///< C
  double ambient = 1;                                          ///< K_a
  double diffuse = 1;                                          ///< K_d
  double specular = 0;                                         ///< K_s
  double shininess = 32;                                       ///< n >= 0
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
  double ior = 1.5;  ///< > 0; relative to the outside
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
  std::optional<Bump> bump{};  ///< applied after the normal map
  /// K_r is multiplied by F and K_t by 1-F, F the exact unpolarized dielectric reflectance. The document's default is
  /// true if transmission > 0 is refracted; the reader resolves it, and reflection's default of 1 with fresnel.
  bool fresnel = false;
  std::string path;  ///< JSON pointer of its definition, e.g. "/materials/red"; prefix of issue pointers
};

// ---- objects -------------------------------------------------------------------------------------------------------

/// world_from_object, affine: a point p goes to (rows[i] . (p, 1)) for i = x, y, z.
struct Transform {
  std::array<std::array<double, 4>, 3> rows{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
  bool operator==(const Transform&) const = default;
};

struct Object {
  Shape shape{};
  MaterialId material{};  ///< unused for an Instance, which has its own
  std::optional<Transform> transform{};
  bool shadow = true;  ///< false: light passes through it, or through all objects of the instance, unchanged
};

/// Objects for instances. A prototype may contain instances of others, without cycles.
struct Prototype {
  std::vector<Object> objects;
  std::string path;            ///< JSON pointer of its definition, e.g. "/prototypes/tree"; prefix of issue pointers
  bool is_one_object = false;  ///< its objects are parts of what stands at `path`, and issues have that pointer
};

// ---- output --------------------------------------------------------------------------------------------------------

enum class Format { png, png16, exr, jpg, hdr, webp, tiff };

/// Properties of the first hit of camera rays: channels of an EXR.
enum class Layer { depth, normal, albedo, object_id, samples, error };

/// Exposure, overflow and palette apply to formats for display; exr and hdr store linear radiance.
struct Output {
  std::vector<Format> formats{Format::png};
  double exposure = 0;  ///< stops: the image times 2^exposure
  /// Tone mapping of values above 1. clamp: 1. scale: the image is divided by its largest channel value if that is
  /// above
  /// 1. reinhard: c / (1 + c) in each channel (Reinhard et al. 2002, eq. 3).
  enum class Overflow { clamp, scale, reinhard };
  Overflow overflow = Overflow::clamp;
  std::uint32_t palette = 0;    ///< png: maximum number of colors, 2 .. 256; 0: no palette
  std::uint32_t quality = 95;   ///< jpg and webp: 1 .. 100
  bool half = false;            ///< exr: colors and alpha as 16-bit floats, layers as without
  std::vector<Layer> layers{};  ///< additional channels of an EXR
  bool alpha = false;           ///< camera rays that hit nothing are transparent
};

struct Scene {
  std::string name;
  ImageSize image{};
  Camera camera{};
  Background background{};
  std::optional<DepthCue> depth_cue{};
  Medium medium{};
  Color ambient{};  ///< I_a
  std::vector<Light> lights;
  std::vector<Asset> assets;
  std::vector<Texture> textures;
  std::vector<Material> materials;
  std::vector<Prototype> prototypes;
  std::vector<Object> objects;
  Accuracy accuracy{};
  Output output{};
};

/// Bytes of the files that a scene names. The caller reads them: the tracer opens no file. `bytes[id.index]` is the
/// content of `scene.assets[id.index]`; entries missing at the end are empty files.
struct Assets {
  std::vector<std::vector<std::uint8_t>> bytes;
};

}  // namespace tracer
