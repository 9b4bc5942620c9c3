// Global light with closed forms: every pixel is noisy, and a part of the noise is in rare, bright paths.
#include <cmath>
#include <numbers>

#include "tests/statistics/error_coverage/corpus.h"
#include "tests/support/scenes.h"
#include "tracer/encode.h"
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

/// Irradiance at (x, y, 0) over pi of a sphere of radiance 1 that is above the ground.
double irradiance(const Sphere& lamp, double x, double y) {
  const Vec3 to = lamp.center - Vec3{x, y, 0};
  return lamp.radius * lamp.radius * to.z / std::pow(dot(to, to), 1.5);
}

/// An empty scene of global light.
CorpusScene global_scene(Canvas canvas) {
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  result.scene.accuracy.model = Accuracy::Model::global;
  return result;
}

/// A ground under a sphere of this radiance.
CorpusScene lit_ground(Canvas canvas, const Color& color, const Sphere& lamp, double glow) {
  CorpusScene result = global_scene(canvas);
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(color));
  scenes::add(result.scene, lamp, scenes::glowing({glow, glow, glow}));
  result.exact = image_of(canvas, [=](double x, double y) { return color * (glow * irradiance(lamp, x, y)); });
  return result;
}

constexpr Color sand{0.8, 0.6, 0.3};

/// The lamp is behind the camera, with a radius of that part of its height.
CorpusScene sphere_lamp(Canvas canvas, Random& random, double part, const Color& color) {
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

/// A closed room in which every surface emits what it absorbs of the radiance 0.4: a ball in each corner of a square.
CorpusScene furnace(Canvas canvas, Random& random, double absorptance) {
  CorpusScene result = global_scene(canvas);
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

/// A wall of mirror shows a lamp that a black disc hides from the ground.
CorpusScene hidden_lamp(Canvas canvas, Random& random) {
  const double w = canvas.width, y = random.in(-0.3, 0.3) * w;
  CorpusScene result = lit_ground(canvas, sand, Sphere{{5 * w, y, 10 * w}, 2 * w}, 25);
  scenes::add(result.scene, Plane{{-3 * w, 0, 0}, {1, 0, 0}, {}}, scenes::mirror(1));
  scenes::add(result.scene, Disc{{1.8 * w, 0.35 * y, 3.5 * w}, {0, 0, 1}, 1.25 * w, 0, {}}, surface({0, 0, 0}));
  const Sphere image{{-11 * w, y, 10 * w}, 2 * w};
  result.exact = image_of(canvas, [=](double px, double py) { return sand * (25 * irradiance(image, px, py)); });
  return result;
}

/// Eighty-one lamps, whose powers are up to 1,000 apart.
CorpusScene many_lamps(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(sand));
  struct Lamp {
    Sphere sphere;
    Color glow;
  };
  std::vector<Lamp> lamps;
  const double w = canvas.width;
  for (int column = -4; column <= 4; ++column)
    for (int row = -4; row <= 4; ++row) {
      const double glow = 20 * std::pow(10, random.in(-3, 0));
      const Sphere sphere{{4 * w * column, 4 * w * row, 20 * w}, random.in(0.1, 1) * w};
      lamps.push_back({sphere, Color{random.in(0, glow), random.in(0, glow), random.in(0, glow)}});
      scenes::add(result.scene, sphere, scenes::glowing(lamps.back().glow));
    }
  result.exact = image_of(canvas, [=](double x, double y) {
    Color sum;
    for (const Lamp& lamp : lamps) sum += sand * lamp.glow * irradiance(lamp.sphere, x, y);
    return sum;
  });
  return result;
}

/// A glowing wall that stands on the ground: the pixels beside it are next to the lamp.
CorpusScene corner_light(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  const double w = canvas.width, wall = -0.501 * w, height = random.in(0.2, 0.6) * w, side = random.in(0.5, 1) * w;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(sand));
  const Mesh lamp = scenes::quad({wall, -side, 0}, {wall, side, 0}, {wall, side, height}, {wall, -side, height});
  scenes::add(result.scene, lamp, scenes::glowing({2, 2, 2}));
  // Form factor from an element to a rectangle at a right angle, from beside its corner: the same catalog, B-4.
  const auto factor = [=](double distance, double part) {
    const double slant = std::hypot(distance, height);
    return (std::atan(part / distance) - distance / slant * std::atan(part / slant)) / (2 * std::numbers::pi);
  };
  result.exact = image_of(canvas, [=](double x, double y) {
    return sand * (2 * (factor(x - wall, side - y) + factor(x - wall, side + y)));
  });
  return result;
}

/// A sky of one radiance with a sun of ten texels, nearly as bright as the rest together.
CorpusScene sunny_sky(Canvas canvas, Random& random) {
  constexpr std::uint32_t columns = 512, rows = 256;
  constexpr double pi = std::numbers::pi;
  CorpusScene result = global_scene(canvas);
  Image sky{columns, rows, {}};
  const auto left = static_cast<std::uint32_t>(random.in(8, 100)), top = static_cast<std::uint32_t>(random.in(64, 190));
  Color irradiance;  // over pi, of the ground that z is perpendicular to: u = 0 is z, and a quarter beside it is seen
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column) {
      const bool sun = column - left < 5 && row - top < 2;
      const Color radiance = sun ? Color{500, 450, 300} : Color{0.1, 0.2, 0.4};
      for (const double channel : {radiance.r, radiance.g, radiance.b}) sky.rgb.push_back(static_cast<float>(channel));
      if (column >= columns / 4 && column < columns * 3 / 4) continue;
      const auto along = [](double v) { return pi * (0.5 - v / rows) / 2 + std::sin(2 * pi * (0.5 - v / rows)) / 4; };
      const auto across = [](double u) { return std::sin(2 * pi * u / columns); };
      irradiance += radiance * ((along(row) - along(row + 1.0)) * (across(column + 1.0) - across(column)) / pi);
    }
  result.scene.textures = {
      {.pattern = ImageTexture{}, .path = "/background/environment", .filter = Texture::Filter::nearest}};
  result.scene.assets = {{"sky.exr", "/background/environment/file"}};
  result.scene.background.environment = Environment{};
  result.assets = {{encode(sky, Format::exr)->bytes}};
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(sand));
  result.exact = image_of(canvas, [=](double, double) { return sand * irradiance; });
  return result;
}

}  // namespace

std::vector<CorpusEntry> global_entries() {
  using enum SettingGroup;
  constexpr const char* family = "global light";
  const auto of = [](auto function, auto... arguments) {
    return [=](Canvas canvas, Random& random) { return function(canvas, random, arguments...); };
  };
  return {
      {family, "large sphere", tiles, of(sphere_lamp, 0.5, sand)},
      {family, "small sphere", tiles, of(sphere_lamp, 0.01, sand)},
      {family, "colors 10,000 apart", tiles, of(sphere_lamp, 0.5, Color{0.9, 9e-3, 9e-5})},
      {family, "furnace", noisy_tiles, of(furnace, 0.4)},
      // Fixed samples where a path has tens of rays or seldom finds light: targets would take the most samples.
      {family, "bright furnace", fixed_samples, of(furnace, 0.1)},
      {family, "lamp in a mirror alone", fixed_samples, hidden_lamp},
      {family, "low lamp", tiles, low_lamp},
      {family, "lamp and its mirror image", noisy_tiles, mirrored_lamp},
      {family, "81 lamps", tiles, many_lamps},
      {family, "lamp in a corner", tiles, corner_light},
      {family, "sun of ten texels", tiles, sunny_sky},
  };
}

}  // namespace error_coverage
