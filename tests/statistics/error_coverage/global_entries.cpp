// Global light with closed forms: every pixel is noisy, and a part of the noise is in rare, bright paths.
#include <cmath>
#include <numbers>

#include "tests/statistics/error_coverage/corpus.h"
#include "tests/support/scenes.h"
#include "tracer/src/math/vec.h"

namespace error_coverage {
namespace {

using namespace tracer;
using oracle::Random;

Material surface(const Color& color, const Color& emission = {}) {
  Material material = scenes::matte(color);
  material.emission = emission;
  return material;
}

Image image_of(Canvas canvas, const std::function<Color(double x, double y)>& radiance) {
  Image image{canvas.width, canvas.height, {}};
  for (std::uint32_t y = 0; y < canvas.height; ++y)
    for (std::uint32_t x = 0; x < canvas.width; ++x) {
      const Color color = radiance(x + 0.5 - canvas.width / 2.0, canvas.height / 2.0 - y - 0.5);
      for (const double channel : {color.r, color.g, color.b}) image.rgb.push_back(static_cast<float>(channel));
    }
  return image;
}

/// Irradiance at (x, y, 0) over pi of a sphere of radiance 1 that is above the ground.
double irradiance(const Sphere& lamp, double x, double y) {
  const Vec3 to = lamp.center - Vec3{x, y, 0};
  return lamp.radius * lamp.radius * to.z / std::pow(dot(to, to), 1.5);
}

/// A ground under a sphere of this radiance.
CorpusScene lit_ground(Canvas canvas, const Color& color, const Sphere& lamp, double glow) {
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  result.scene.accuracy.model = Accuracy::Model::global;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(color));
  scenes::add(result.scene, lamp, scenes::glowing({glow, glow, glow}));
  result.exact = image_of(canvas, [=](double x, double y) { return color * (glow * irradiance(lamp, x, y)); });
  return result;
}

constexpr Color sand{0.8, 0.6, 0.3};

/// The lamp is behind the camera, with a radius of that part of its height.
CorpusScene sphere_lamp(Canvas canvas, Random& random, double part, const Color& color = sand) {
  const double height = 20.0 * canvas.width, aside = random.in(-0.3, 0.3) * canvas.width;
  return lit_ground(canvas, color, Sphere{{aside, 0, height}, part * height}, 0.6 / (part * part));
}

/// A lamp close to the ground beside the image, so that a few pixels are far brighter than the others.
CorpusScene low_lamp(Canvas canvas, Random& random) {
  const double w = canvas.width;
  return lit_ground(canvas, sand, Sphere{{0.8 * w, random.in(-0.3, 0.3) * w, 0.1 * w}, 0.05 * w}, 60);
}

/// A wall of mirror shows the lamp once more: no ray toward an emitter finds that light.
CorpusScene mirrored_lamp(Canvas canvas, Random& random) {
  const double w = canvas.width, aside = random.in(-0.3, 0.3) * w;
  const Sphere lamp{{aside, 0, 10 * w}, 2 * w}, image{{-6 * w - aside, 0, 10 * w}, 2 * w};
  CorpusScene result = lit_ground(canvas, sand, lamp, 15);
  scenes::add(result.scene, Plane{{-3 * w, 0, 0}, {1, 0, 0}, {}}, scenes::mirror(1));
  result.exact = image_of(
      canvas, [=](double x, double y) { return sand * (15 * (irradiance(lamp, x, y) + irradiance(image, x, y))); });
  return result;
}

/// A lamp behind a pane that lets half of its light through, and no ray toward an emitter.
CorpusScene lamp_behind_pane(Canvas canvas, Random& random) {
  CorpusScene result = sphere_lamp(canvas, random, 0.25);
  Material pane = surface({0, 0, 0});
  pane.transparency = Material::Transparency::filtered;
  pane.transmission = 0.5;
  scenes::add(result.scene, Plane{{0, 0, 9.0 * canvas.width}, {0, 0, 1}, {}}, pane);
  for (float& value : result.exact->rgb) value /= 2;
  return result;
}

/// A dark room: the sky shines through a round hole in its ceiling.
CorpusScene hole(Canvas canvas, Random& random) {
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  result.scene.accuracy.model = Accuracy::Model::global;
  result.scene.background.color = {20, 16, 10};
  const double w = canvas.width, height = 10 * w, radius = 1.5 * w, rim = 1e4 * w;
  const double aside = random.in(-0.3, 0.3) * w;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(sand));
  scenes::add(result.scene, Disc{{aside, 0, height}, {0, 0, 1}, rim, radius, {}}, surface({0, 0, 0}));
  // Form factor of a parallel disc (Howell, Menguc, "A Catalog of Radiation Heat Transfer Configuration Factors",
  // B-13).
  const auto part = [=](double squared, double r) {
    const double sum = squared + height * height + r * r;
    return (1 - (sum - 2 * r * r) / std::sqrt(sum * sum - 4 * squared * r * r)) / 2;
  };
  const Color sky = result.scene.background.color;
  result.exact = image_of(canvas, [=](double x, double y) {
    const double squared = (x - aside) * (x - aside) + y * y;
    return sand * sky * (part(squared, radius) + 1 - part(squared, rim));
  });
  return result;
}

/// A closed room in which every surface emits what it absorbs of the radiance 0.4: a ball in each corner of a square.
CorpusScene furnace(Canvas canvas, Random& random, double absorptance) {
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  result.scene.accuracy.model = Accuracy::Model::global;
  constexpr double level = 0.4;
  const auto balanced = [&](const Color& color) {
    return surface(color, {level * (1 - color.r), level * (1 - color.g), level * (1 - color.b)});
  };
  const double side = 2.0 * canvas.width, kept = 1 - absorptance;
  scenes::add(result.scene, Box{{-side, -side, -side}, {side, side, 9.0 * canvas.width}}, balanced({kept, kept, kept}));
  for (const double x : {-0.25, 0.25})
    for (const double y : {-0.25, 0.25}) {
      Material ball = balanced({random.in(0, kept), random.in(0, kept), random.in(0, kept)});
      if (x < 0 && y < 0) {  // one lets light through
        ball = balanced({0.7, 0.7, 0.7});
        ball.color = Color{0.3, 0.3, 0.3};
        ball.diffuse_transmission = 0.4;
      }
      const double radius = random.in(0.05, 0.2) * canvas.height;
      scenes::add(result.scene, Sphere{{x * canvas.width, y * canvas.height, 0}, radius}, ball);
    }
  result.exact = image_of(canvas, [](double, double) { return Color{level, level, level}; });
  return result;
}

/// A ground beside a black wall under a sky: half of the sky is in sight. The wall is in any direction: along an axis
/// it would divide the stratified directions in halves, without an error.
CorpusScene half_sky(Canvas canvas, Random& random) {
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  result.scene.accuracy.model = Accuracy::Model::global;
  const Color ground = random.color(0.2), sky = random.color(0.2);
  result.scene.background.color = sky;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(ground));
  const double azimuth = random.in(0, 2 * std::numbers::pi);
  const Vec3 normal{std::cos(azimuth), std::sin(azimuth), 0};
  scenes::add(result.scene, Plane{normal * (-1.0 * canvas.width), normal, {}}, surface({0, 0, 0}));
  result.exact = image_of(canvas, [=](double, double) { return ground * sky * 0.5; });
  return result;
}

}  // namespace

std::vector<CorpusEntry> global_entries() {
  using enum SettingGroup;
  constexpr const char* family = "global light";
  return {
      {family, "large sphere", tiles, [](Canvas c, Random& r) { return sphere_lamp(c, r, 0.5); }},
      {family, "small sphere", tiles, [](Canvas c, Random& r) { return sphere_lamp(c, r, 0.01); }},
      {family, "furnace", tiles, [](Canvas c, Random& r) { return furnace(c, r, 0.4); }},
      {family, "bright furnace", targets, [](Canvas c, Random& r) { return furnace(c, r, 0.1); }, true, true},
      {family, "furnace of 0.99", targets, [](Canvas c, Random& r) { return furnace(c, r, 0.01); }, true, true},
      {family, "half of the sky", tiles, half_sky},
      {family, "colors 10,000 apart", tiles,
       [](Canvas c, Random& r) {
         return sphere_lamp(c, r, 0.5, {0.9, 9e-3, 9e-5});
       }},
      {family, "low lamp", tiles, low_lamp},
      {family, "lamp and its mirror image", tiles, mirrored_lamp},
      {family, "lamp behind a pane", tiles, lamp_behind_pane},
      {family, "sky through a hole", tiles, hole},
  };
}

}  // namespace error_coverage
