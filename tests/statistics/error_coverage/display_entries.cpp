// Errors outside of sampling: tone curves with statistics of the image, approximations, bounds, files, dilution.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/statistics/error_coverage/corpus.h"
#include "tests/support/scenes.h"

namespace error_coverage {
namespace {

using namespace tracer;
using oracle::Random;

const Color plain{0.3, 0.32, 0.35};

/// Hot squares before a gradient with some ordinary edges.
CorpusScene hot_squares(Canvas canvas, Random& random, double side, double radiance, const Output& output) {
  FlatScene flat(canvas, {0.1, 0.1, 0.15}, {0.6, 0.55, 0.5});
  int number = 0;
  for (const Vec2& place : random_places(canvas, random, 8, 24)) {
    const bool hot = number++ < 2;
    const double size = hot ? side : 12;
    const Color color = hot ? Color{radiance, radiance, radiance} : Color{0.8, 0.4, 0.1};
    flat.add(rectangle(place, size, size, random.in(0, std::numbers::pi)), color);
  }
  flat.scene().output = output;
  return finished(flat);
}

/// A plane under a directional light and an occluder of the same material and orientation: only its shadow is visible.
CorpusScene small_shadow(Canvas canvas, Random& random, double side, Approximations::Shadows shadows) {
  constexpr double height = 20;
  CorpusScene result;
  Scene& scene = result.scene = orthographic_scene(canvas);
  scene.ambient = {0.1, 0.1, 0.1};
  scene.lights.push_back(scenes::directional_light({1, 0, -1}));
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, scenes::matte({0.9, 0.9, 0.9}));
  const Polygon shadow = rectangle(random_place(canvas, random, 30), side, side, random.in(0, 1));
  Mesh occluder;
  for (const Vec2& corner : shadow) occluder.positions.push_back({corner.x - height, corner.y, height});
  occluder.triangles = {{0, 1, 2}, {0, 2, 3}};
  scenes::add(scene, occluder, MaterialId{0});
  scene.accuracy.approximate.shadows = shadows;
  const double ambient = 0.09, lit = ambient + 0.9 / std::numbers::sqrt2;
  BoxFilteredImage image(canvas, {.center = {lit, lit, lit}});
  image.replace(shadow, {ambient, ambient, ambient});
  result.exact = image.image();
  return result;
}

/// Solids with the approximations that change few of their pixels or all of them slightly.
CorpusScene approximate_solids(Canvas canvas, Random& random) {
  CorpusScene result = random_solids(canvas, random);
  Approximations& approximate = result.scene.accuracy.approximate;
  if (random.chance(0.5)) approximate.shading = Approximations::Shading::flat;
  if (random.chance(0.5)) approximate.reflections = Approximations::Reflections::environment;
  approximate.nearest_lights = 1;
  return result;
}

/// A small mirror tilted by 45 degrees that reflects the background; without reflections it is black.
CorpusScene small_mirror(Canvas canvas, Random& random, double side) {
  CorpusScene result;
  Scene& scene = result.scene = orthographic_scene(canvas);
  scene.background.color = plain;
  const Polygon patch = rectangle(random_place(canvas, random, 10), side, side);
  Mesh mirror;
  for (const Vec2& corner : patch) mirror.positions.push_back({corner.x, corner.y, -corner.y});
  mirror.triangles = {{0, 1, 2}, {0, 2, 3}};
  scenes::add(scene, mirror, scenes::mirror(0.9));
  scene.accuracy.approximate.reflections = Approximations::Reflections::none;
  BoxFilteredImage image(canvas, {.center = plain});
  image.replace(patch, {0.9 * plain.r, 0.9 * plain.g, 0.9 * plain.b});
  result.exact = image.image();
  return result;
}

/// Two infinite mirrors that emit; every path is infinite, and the image has two radiances, divided by the horizon. A
/// lamp below the floor, of radiance `lamp`, is visible from nowhere, but a bound of the radiance may contain it.
CorpusScene mirror_hall(Canvas canvas, Random& random, double reflection, double lamp) {
  const double roll = random.in(-0.6, 0.6), floor = 0.2 * (1 - reflection), ceiling = 2 * floor;
  CorpusScene result;
  Scene& scene = result.scene;
  scene.image = {canvas.width, canvas.height};
  scene.camera = {{0, 3, 0}, {1, 3, 0}, {0, std::cos(roll), std::sin(roll)}, 40};
  for (const auto& [height, emission] : {std::pair{0.0, floor}, std::pair{6.0, ceiling}}) {
    Material wall = scenes::mirror(reflection);
    wall.emission = Color{emission, emission, emission};
    scenes::add(scene, Plane{{0, height, 0}, {0, 1, 0}, {}}, wall);
  }
  if (lamp > 0) scenes::add(scene, Sphere{{0, -10, 0}, 1}, scenes::glowing({lamp, lamp, lamp}));
  const double series = 1 / (1 - reflection * reflection);
  const double below = series * (floor + reflection * ceiling), above = series * (ceiling + reflection * floor);
  BoxFilteredImage image(canvas, {.center = {below, below, below}});
  const double reach = canvas.width + canvas.height;  // the half plane -x sin(roll) + y cos(roll) > 0
  image.replace(rectangle({-reach * std::sin(roll), reach * std::cos(roll)}, 2 * reach, 2 * reach, roll),
                {above, above, above});
  result.exact = image.image();
  return result;
}

/// Edges of all directions between saturated colors, before a gradient: hard for block codecs and palettes.
CorpusScene colored_discs(Canvas canvas, Random& random) {
  FlatScene flat(canvas, {0.02, 0.1, 0.3}, {0.7, 0.8, 0.9});
  for (const Vec2& place : random_places(canvas, random, static_cast<int>(canvas.width / 12), 17))
    flat.add(disc(place, random.in(3, 8)), random.color());
  return finished(flat);
}

/// A wheel of sectors with a radius of 40 pixels on any canvas, so that a larger canvas has the same error in fewer
/// of its pixels.
CorpusScene wheel(Canvas canvas, Random& random, std::uint32_t canvas_factor) {
  const Canvas large{canvas.width * canvas_factor, canvas.height * canvas_factor};
  FlatScene flat(large, plain);
  const Vec2 center = random_place(large, random, 50);
  constexpr int sectors = 40;
  for (int i = 0; i < sectors; ++i) {
    const double from = (i + random.in(0, 0.1)) * 2 * std::numbers::pi / sectors,
                 to = from + std::numbers::pi / sectors;
    flat.add({{center.x, center.y},
              {center.x + 40 * std::cos(from), center.y + 40 * std::sin(from)},
              {center.x + 40 * std::cos(to), center.y + 40 * std::sin(to)}},
             {0.9, 0.85, 0.2});
  }
  return finished(flat);
}

/// An entry of another file whose image is divided by its brightest channel.
CorpusEntry scaled(const std::vector<CorpusEntry>& entries, const std::string& name) {
  CorpusEntry entry = *std::ranges::find(entries, name, &CorpusEntry::name);
  entry.family = "image statistics";
  entry.name = "scale, " + name;
  entry.settings = SettingGroup::budgets;
  entry.build = [build = entry.build](Canvas canvas, Random& random) {
    CorpusScene scene = build(canvas, random);
    scene.scene.output = {.exposure = 3, .overflow = Output::Overflow::scale};
    return scene;
  };
  return entry;
}

}  // namespace

std::vector<CorpusEntry> display_entries() {
  using enum SettingGroup;
  using Overflow = Output::Overflow;
  using Shadows = Approximations::Shadows;
  const auto of = [](auto function, auto... arguments) {
    return [=](Canvas canvas, Random& random) { return function(canvas, random, arguments...); };
  };
  const Output scale{.overflow = Overflow::scale}, reinhard{.overflow = Overflow::reinhard}, bright{.exposure = 2};
  return {
      {"image statistics", "scale, hot squares of 0.7 pixels", targets, of(hot_squares, 0.7, 8.0, scale)},
      {"image statistics", "scale, hot squares of 0.3 pixels", targets, of(hot_squares, 0.3, 40.0, scale)},
      {"image statistics", "scale, hot squares of 12 pixels", budgets, of(hot_squares, 12.0, 8.0, scale)},
      scaled(ordinary_entries(), "checker"),
      scaled(ordinary_entries(), "penumbra"),
      scaled(global_entries(), "large sphere"),
      {"image statistics", "reinhard, hot squares of 0.7 pixels", targets, of(hot_squares, 0.7, 8.0, reinhard)},
      {"image statistics", "exposure 2, squares of 0.7 pixels", targets, of(hot_squares, 0.7, 4.0, bright)},
      {"approximations", "shadows none, shadow of 4 pixels", approximations, of(small_shadow, 4.0, Shadows::none)},
      {"approximations", "shadows none, shadow of 12 pixels", approximations, of(small_shadow, 12.0, Shadows::none)},
      {"approximations", "shadows map, shadow of 12 pixels", approximations, of(small_shadow, 12.0, Shadows::map)},
      {"approximations", "solids, nearest light", approximations, approximate_solids, false},
      {"approximations", "reflections none, mirror of 5 pixels", approximations, of(small_mirror, 5.0)},
      {"path bounds", "hall of mirrors of 0.95", bounds, of(mirror_hall, 0.95, 0.0)},
      {"path bounds", "hall of mirrors of 0.95, hidden lamp", bounds, of(mirror_hall, 0.95, 4.0)},
      {"path bounds", "hall of mirrors of 0.8", bounds, of(mirror_hall, 0.8, 0.0)},
      {"encoding", "colored discs", files, colored_discs},
      {"dilution", "wheel", tiles, of(wheel, 1U)},
      {"dilution", "wheel on four times the canvas", tiles, of(wheel, 2U)},
  };
}

}  // namespace error_coverage
