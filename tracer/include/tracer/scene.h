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
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/format.h"
#include "tracer/lights.h"
#include "tracer/materials.h"
#include "tracer/shapes.h"
#include "tracer/values.h"

namespace tracer {

/// A file that the scene names. The caller supplies its bytes (Assets).
struct Asset {
  std::string name;                ///< as written in the document: "wood.png"
  std::string path;                ///< JSON pointer of its first use, e.g. "/textures/floor/file"
  std::vector<AssetId> buffers{};  ///< glTF: files of buffers that are not in this one, in their order there
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

  static constexpr std::string_view noun = "the image";
  static constexpr auto fields() {
    return std::tuple{optional_field("width", &ImageSize::width, FieldRange::count()),
                      optional_field("height", &ImageSize::height, FieldRange::count()),
                      Field{"crop", &ImageSize::crop}};
  }
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

  static constexpr auto fields() {
    return std::tuple{optional_field("type", &Camera::type),
                      Field{"position", &Camera::position, FieldRange::position},
                      Field{"look_at", &Camera::look_at, FieldRange::position},
                      optional_field("up", &Camera::up, FieldRange::direction),
                      optional_field("fov", &Camera::fov_deg),
                      Field{"height", &Camera::height, FieldRange::length, FieldPresence::derived},
                      optional_field("aperture", &Camera::aperture, FieldRange::length_or_0),
                      Field{"focus_distance", &Camera::focus_distance, FieldRange::length},
                      optional_field("eye_separation", &Camera::eye_separation, FieldRange::length_or_0),
                      Field{"layout", &Camera::layout, FieldRange::any, FieldPresence::derived}};
  }
};
constexpr auto words_of(Camera::Type first) { return in_order(first, {"perspective", "orthographic", "panorama"}); }
constexpr auto words_of(Camera::Layout) { return in_order(Camera::Layout::side_by_side, {"side_by_side", "anaglyph"}); }

/// nadir for directions opposite to the background's `up`, zenith along it, linear in the cosine between.
struct Gradient {
  Color zenith{}, nadir{};

  static constexpr std::string_view noun = "a background with zenith and nadir";
  static constexpr auto fields() {
    return std::tuple{Field{"zenith", &Gradient::zenith}, Field{"nadir", &Gradient::nadir}};
  }
};

/// Equirectangular texture of all directions, as a panorama camera renders it: u = 1/2 is world -z projected across the
/// background's `up` (+x if up is along z) and grows to the right; v = 0 is straight down, 1 straight up. With a
/// texture scale of 1, u is periodic and v is clamped at the poles for every `wrap`.
struct Environment {
  TextureId texture{};
  double rotation_deg = 0;  ///< about up, counter-clockwise seen from the tip of up; any finite angle

  static constexpr std::string_view noun = "a background with an environment";
  static constexpr auto fields() {
    return std::tuple{Field{"environment", &Environment::texture},
                      optional_field("rotation", &Environment::rotation_deg)};
  }
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

  static constexpr std::string_view noun = "the depth cue";
  static constexpr auto fields() {
    return std::tuple{Field{"front", &DepthCue::front, FieldRange::position},
                      Field{"back", &DepthCue::back, FieldRange::position},
                      optional_field("front_scale", &DepthCue::front_scale, FieldRange::fraction()),
                      optional_field("back_scale", &DepthCue::back_scale, FieldRange::fraction()),
                      optional_field("color", &DepthCue::color)};
  }
};

/// The medium outside of all solids.
struct Medium {
  Color absorption{};  ///< per scene unit, as that of a Material; light from infinitely far does not arrive through it

  static constexpr std::string_view noun = "the medium";
  static constexpr auto fields() { return std::tuple{optional_field("absorption", &Medium::absorption)}; }
};

// ---- lights --------------------------------------------------------------------------------------------------------

/// f(d) for the distance d from light to surface. `none`: 1. `polynomial`: min(1/(c0 + c1 d + c2 d^2), 1), c_i >= 0
/// with a positive sum. `inverse_square`: 1/d^2, unclamped. (Foley, van Dam et al. 1990, eq. 16.8.)
struct Attenuation {
  enum class Kind { none, inverse_square, polynomial };
  Kind kind = Kind::none;
  std::array<double, 3> coefficients{1, 0, 0};
};
constexpr auto words_of(Attenuation::Kind first) { return in_order(first, {"none", "inverse_square"}); }

struct Light {
  LightSource source{};
  Color color{1, 1, 1};
  double intensity = 1;
  bool shadows = true;
  Attenuation attenuation{};  ///< ignored by directional lights (f = 1)

  static constexpr auto fields() {
    return std::tuple{optional_field("color", &Light::color),
                      optional_field("intensity", &Light::intensity, FieldRange::factor),
                      optional_field("shadows", &Light::shadows), optional_field("attenuation", &Light::attenuation)};
  }
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

/// Properties of the first hit of camera rays: channels of an EXR.
enum class Layer { depth, normal, albedo, object_id, samples, error };
constexpr auto words_of(Layer first) {
  return in_order(first, {"depth", "normal", "albedo", "object_id", "samples", "error"});
}

/// Exposure, overflow and palette apply to formats for display; the others store linear radiance.
struct Output {
  std::vector<Format> formats{Format::png};
  double exposure = 0;  ///< stops: the image times 2^exposure
  /// Tone mapping of values above 1. clamp: 1. scale: the image is divided by its largest channel value if that is
  /// above
  /// 1. reinhard: c / (1 + c) in each channel (Reinhard et al. 2002, eq. 3).
  enum class Overflow { clamp, scale, reinhard };
  Overflow overflow = Overflow::clamp;
  std::uint32_t palette = 0;    ///< png: maximum number of colors, 2 .. 256; 0: no palette
  std::uint32_t quality = 95;   ///< lossy formats for display: 1 .. 100
  bool half = false;            ///< exr: colors and alpha as 16-bit floats, layers as without
  std::vector<Layer> layers{};  ///< additional channels of an EXR
  bool alpha = false;           ///< camera rays that hit nothing are transparent

  static constexpr std::string_view noun = "the output";
  static constexpr auto fields() {
    return std::tuple{optional_field("formats", &Output::formats),
                      // 2^100 is Limits::value_max, so the darkest and brightest images can be displayed.
                      optional_field("exposure", &Output::exposure, FieldRange::within(-100, 100)),
                      optional_field("overflow", &Output::overflow),
                      Field{"palette", &Output::palette, FieldRange::within(2, 256), FieldPresence::derived},
                      optional_field("quality", &Output::quality, FieldRange::within(1, 100)),
                      optional_field("half", &Output::half), optional_field("layers", &Output::layers),
                      optional_field("alpha", &Output::alpha)};
  }
};
constexpr auto words_of(Output::Overflow first) { return in_order(first, {"clamp", "scale", "reinhard"}); }

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
