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

/// A ground under a glowing sphere behind the camera, with a radius of that part of its height.
CorpusScene sphere_lamp(Canvas canvas, Random& random, double part) {
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  result.scene.accuracy.model = Accuracy::Model::global;
  const Color color{0.8, 0.6, 0.3};
  const double height = 20.0 * canvas.width, radius = part * height, glow = 0.6 / (part * part);
  const double aside = random.in(-0.3, 0.3) * canvas.width;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(color));
  scenes::add(result.scene, Sphere{{aside, 0, height}, radius}, scenes::glowing({glow, glow, glow}));
  result.exact = image_of(canvas, [=](double x, double y) {
    const double squared = (x - aside) * (x - aside) + y * y + height * height;
    return color * (glow * radius * radius * height / std::pow(squared, 1.5));
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
      {family, "half of the sky", tiles, half_sky},
  };
}

}  // namespace error_coverage
