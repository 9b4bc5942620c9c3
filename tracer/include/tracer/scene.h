#pragma once
/// A scene as plain values: what the scene document says, with references resolved to handles.
///
/// Frame and units: right-handed world, lengths in scene units, angles in degrees (suffix `_deg`), colours linear RGB.
/// Every default is the document's default. A Scene owns all its data, can be copied and moved, and is never changed
/// by the tracer. It may hold anything; `validate` says whether it can be rendered.

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

/// A file that the scene names. Its bytes come with the scene (tracer/assets.h): the tracer opens no file.
struct Asset {
  std::string name;  ///< as the document writes it: "wood.png"
  std::string path;  ///< where the document first names it, e.g. "/textures/floor/file"
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
  std::uint32_t width = 640, height = 480;  ///< pixels; row 0 is on top, sample (x,y) covers [x,x+1) x [y,y+1)
  std::optional<PixelWindow> crop{};        ///< the part that is rendered, bit for bit that of the full image

  /// What is rendered; the image has its size.
  [[nodiscard]] PixelWindow window() const { return crop.value_or(PixelWindow{0, 0, width, height}); }
};

struct Camera {
  Vec3 position{};
  Vec3 look_at{};  ///< in the middle of the image
  Vec3 up{0, 1, 0};
  double fov_deg = 45;  ///< perspective: full vertical angle, 0 < fov_deg < 180
  /// perspective: rays from `position` through a window that spans `fov_deg`; pixels are square. orthographic: parallel
  /// rays from a window of `height` around `position`, nothing behind it is seen; pixels are square. panorama:
  /// equirectangular, 360 degrees to the right across the image and 180 down, whatever its proportions.
  enum class Type { perspective, orthographic, panorama };
  Type type = Type::perspective;
  double height = 1;  ///< orthographic: of the window, world; the document must say it
  /// Diameter of a thin lens, world; 0 is a pinhole. What lies on the plane at `focus_distance` along the viewing axis
  /// is sharp; a panorama's lens turns with the ray, and the sphere of that radius is. One sample a pixel goes through
  /// the lens's centre.
  double aperture = 0;
  std::optional<double> focus_distance{};  ///< unset: that of `look_at`
};

/// nadir where a direction points against the camera's `up`, zenith where along it, linear in the cosine between.
struct Gradient {
  Color zenith{}, nadir{};
};

/// A texture once around the world: u = 1/2 looks along the world's -z projected across the camera's `up` (+x where up
/// is along z) and grows to the right; v = 0 is straight down, 1 straight up. What a panorama camera sees that looks
/// that way. Where the texture's scale is 1, u is closed into a circle and v ends at the poles, whatever its `wrap`.
struct Environment {
  TextureId texture{};
  double rotation_deg = 0;  ///< about up, counter-clockwise for a viewer to whom it points; any finite angle
};

/// A texture on each face of a cube around the world, seen from inside with u to the right and v up: on the faces
/// around, up is the world axis next to the camera's `up`; the faces above and below are seen by leaning back and forth
/// from the one that faces -z (+x where up is z). Order: +x, -x, +y, -y, +z, -z.
struct CubeMap {
  std::array<TextureId, 6> faces{};
};

/// What every ray that hits nothing sees: `color`, or the one of the others that is set.
struct Background {
  Color color{};
  std::optional<Gradient> gradient{};
  std::optional<Environment> environment{};
  std::optional<CubeMap> cube{};
};

/// I' = S I + (1-S) color for what a camera ray sees, by its distance z along the viewing axis (a panorama: along the
/// ray): S is front_scale up to `front`, back_scale beyond `back` and where nothing is hit, linear between. Where front
/// and back are one it steps behind them. (Foley, van Dam et al. 1990, sec. 16.1.3.)
struct DepthCue {
  double front = 0, back = 0;              ///< world, front <= back
  double front_scale = 1, back_scale = 0;  ///< [0, 1]
  Color color{};
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

/// Unit squares of the looked-up coordinates: colors[0] where floor(u) + floor(v) is even.
struct CheckerTexture {
  std::array<Color, 2> colors{};
};

/// From colors[0] at v = 0 to colors[1] at v = 1, linearly.
struct GradientTexture {
  std::array<Color, 2> colors{};
};

/// Gradient noise n(u, v) in [-1, 1] with a cell of one unit (Perlin 2002): from colors[0] at -1 to colors[1] at 1.
/// `octaves` of it are summed, each at twice the frequency and half the amplitude of the one before, over the sum of
/// the amplitudes.
struct NoiseTexture {
  std::array<Color, 2> colors{};
  std::uint32_t octaves = 1;  ///< 1..32
};

enum class ColorSpace { linear, srgb };

/// An image file over the unit square: v = 0 is the lower edge of its bottom row. Its first three channels are red,
/// green and blue; one or two are grey; alpha is left out.
struct ImageTexture {
  AssetId file{};
  std::optional<ColorSpace> color_space;  ///< unset: sRGB for PNG and JPEG, linear for OpenEXR and Radiance HDR
};

/// Looked up at (u scale.x + offset.x, v scale.y + offset.y).
struct Texture {
  std::variant<CheckerTexture, GradientTexture, NoiseTexture, ImageTexture> pattern{};
  Vec2 scale{1, 1};
  Vec2 offset{0, 0};
  std::string path;  ///< where the document defines it, e.g. "/textures/floor"; prefix of issue pointers
  /// How gradients and images go on beyond [0, 1]. Checkers and noise have no edge: for them all three are the same.
  enum class Wrap { repeat, clamp, mirror };
  Wrap wrap = Wrap::repeat;
  /// nearest: the texel, or the pattern at the point itself. bilinear: between four texels; patterns as nearest.
  /// mipmap: the mean over what the sample covers of the surface. A sample covers 1 / sqrt(samples) of its pixel's
  /// width, so filtering narrows as samples take its place and does not bias the converged image.
  enum class Filter { nearest, bilinear, mipmap };
  Filter filter = Filter::mipmap;
};

using ColorOrTexture = std::variant<Color, TextureId>;

/// A relief that bends normals and leaves the surface where it is (Blinn 1978, "Simulation of Wrinkled Surfaces"): its
/// height above the front is `scale`, in scene units, times the mean of the texture's linear red, green and blue.
struct Bump {
  TextureId texture{};
  double scale = 1;  ///< may be negative: dents for bumps
};

/// What a surface does with light (Whitted 1980; Phong 1975; Blinn 1977):
///   I_local = emission + K_a C I_a + sum_i f_i S_i I_i [ K_d C max(0,N.L) + K_s C_s spec ],  spec = 0 where N.L <= 0
///   I = I_local + K_r C_r I(reflected) + K_t C_t I(transmitted)
/// N is on the side of the ray: a hit on the back uses -N.
struct Material {
  enum class Model { lambert, phong, blinn_phong };
  Model model = Model::phong;
  ColorOrTexture color = Color{0.8, 0.8, 0.8};  ///< C
  double ambient = 1;                           ///< K_a
  double diffuse = 1;                           ///< K_d
  double specular = 0;                          ///< K_s
  double shininess = 32;                        ///< n >= 0
  Color specular_color{1, 1, 1};                ///< C_s
  Color emission{};
  double reflection = 0;              ///< K_r in [0,1]
  Color reflection_color{1, 1, 1};    ///< C_r
  double transmission = 0;            ///< K_t in [0,1]; filtered transparency may have more
  Color transmission_color{1, 1, 1};  ///< C_t
  /// How K_t > 0 transmits. refract: by Snell's law; total internal reflection adds K_t C_t to the reflected weight.
  /// interpolated: straight on, I = (1 - K_t)(ambient + diffuse) + specular + emission + K_t I_behind.
  /// filtered: straight on, I = I_local + K_t C_t I_behind. (Foley, van Dam et al. 1990, sec. 16.5.1.)
  enum class Transparency { refract, interpolated, filtered };
  Transparency transparency = Transparency::refract;
  double ior = 1.5;  ///< > 0; the outside has 1
  /// Where solids overlap, the one of highest priority fills the overlap; among equals, the one entered last.
  int priority = 0;
  Color absorption{};  ///< per scene unit: radiance travelling a length s inside is multiplied by exp(-absorption s)
  /// smooth: interpolated normals where the mesh has them. flat: the face's. gouraud: the local model is evaluated at
  /// the corners of the mesh's triangles and interpolated; on other shapes the same as smooth.
  enum class Shading { smooth, flat, gouraud };
  Shading shading = Shading::smooth;
  /// Normals in the surface's own frame: (red, green, blue) = n/2 + 1/2 with n.x along dp/du, n.y along dp/dv and n.z
  /// out of the front. An image that tells no colour space is linear here, whatever its kind.
  std::optional<TextureId> normal_map{};
  std::optional<Bump> bump{};  ///< of the normal map's normals where there is one too
  /// K_r is multiplied by F and K_t by 1-F, F the exact unpolarised dielectric reflectance. The document's default is
  /// true where transmission > 0 is refracted; the reader resolves it, as it does reflection's default of 1 under
  /// fresnel.
  bool fresnel = false;
  std::string path;  ///< where the document defines it, e.g. "/materials/red"; prefix of issue pointers
};

// ---- objects -------------------------------------------------------------------------------------------------------

/// world_from_object, affine: a point p goes to (rows[i] . (p, 1)) for i = x, y, z.
struct Transform {
  std::array<std::array<double, 4>, 3> rows{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
  bool operator==(const Transform&) const = default;
};

struct Object {
  Shape shape{};
  MaterialId material{};  ///< not an instance's: it has its own
  std::optional<Transform> transform{};
};

/// Objects that instances place; a prototype may hold instances of others, never in a circle.
struct Prototype {
  std::vector<Object> objects;
  std::string path;  ///< where the document defines it, e.g. "/prototypes/tree"; prefix of issue pointers
};

// ---- what the user asks for ----------------------------------------------------------------------------------------

enum class Format { png, png16, exr, jpg, hdr, webp, tiff };

/// What is measured at the first thing that a camera ray hits, beside its colour: channels of an EXR.
enum class Layer { depth, normal, albedo, object_id, samples, error };

/// Exposure, overflow and palette are of the formats for display: exr and hdr hold the radiance as it is.
struct Output {
  std::vector<Format> formats{Format::png};
  double exposure = 0;  ///< stops: the image times 2^exposure
  /// What becomes of what is brighter than a display. clamp: 1. scale: the image divided by its brightest channel
  /// where that is above 1. reinhard: c / (1 + c) in each channel (Reinhard et al. 2002, eq. 3).
  enum class Overflow { clamp, scale, reinhard };
  Overflow overflow = Overflow::clamp;
  std::uint32_t palette = 0;    ///< png: at most so many colours, 2 .. 256; 0 is all
  std::vector<Layer> layers{};  ///< of an EXR
  bool alpha = false;           ///< what camera rays see of the background is transparent
};

struct Scene {
  std::string name;
  ImageSize image{};
  Camera camera{};
  Background background{};
  std::optional<DepthCue> depth_cue{};
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

}  // namespace tracer
