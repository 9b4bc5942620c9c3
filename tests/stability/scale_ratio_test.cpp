// Small things in scenes that are up to 10^30 times larger.
#include <gtest/gtest.h>

#include <string>

#include "tests/stability/table.h"
#include "tracer/src/math/vec.h"

namespace {

using namespace tracer;
using stability::Oracle;
using stability::Row;

constexpr int shape_kinds = 9, far_kinds = 6, enclosures = 3;
constexpr double ratios[] = {1e3, 1e7, 1e8, 1e12, 1e14, 1e16, 1e18, 1e24, 1e30};

/// A shape of about two units around `place`.
Shape shape_at(int kind, const Vec3& place, double unit) {
  const auto at = [&](double x, double y, double z) { return (place + Vec3{x, y, z}) * unit; };
  switch (kind) {
    case 0:
      return Sphere{at(0, 0, 0), unit};
    case 1:
      return Box{at(-0.7, -0.8, -0.9), at(0.6, 0.9, 0.8)};
    case 2:
      return Cylinder{at(-0.5, -0.8, 0.2), at(0.4, 0.9, -0.1), 0.6 * unit, true, {}};
    case 3:
      return Cone{at(0.2, 1, 0.1), at(-0.1, -0.9, 0), 0.8 * unit, 0.1 * unit, true, {}};
    case 4:
      return Disc{at(0, 0, 0), {0.3, 0.4, 1}, unit, 0.3 * unit, {}};
    case 5:
      return Torus{at(0, 0, 0), {0.5, 1, 0.4}, 0.8 * unit, 0.3 * unit, {}};
    case 6:
      return Triangle{{{at(-1, -0.9, 0.2), at(0.9, -0.7, -0.3), at(0.1, 1, 0)}}, {}, {}};
    default:
      return scenes::placed(scenes::icosphere(1), unit, at(0, 0, 0));
  }
}

/// A matte shape over a floor with its shadow, and before a mirror; all within ten units of `place`.
Scene small_scene(int kind, const Vec3& place, double unit) {
  const auto at = [&](double x, double y, double z) { return (place + Vec3{x, y, z}) * unit; };
  Scene scene = scenes::empty(24, {at(0.3, 1.5, 6), at(0, 0, 0), {0, 1, 0}, 45});
  scene.ambient = {0.1, 0.1, 0.1};
  scene.lights = {scenes::point_light(at(3, 6, 4))};
  const bool moved = kind == shape_kinds - 1;
  scenes::add(scene, moved ? shape_at(0, {0, 0, 0}, 1) : shape_at(kind, place, unit), scenes::matte({0.8, 0.2, 0.1}));
  if (moved) {  // an ellipsoid that is oblique to the axes
    const Vec3 to = at(0, 0, 0);
    const double u = unit;
    scene.objects.back().transform = Transform{
        {{{0.6 * u, -0.5 * u, 0.1 * u, to.x}, {0.4 * u, 0.7 * u, 0, to.y}, {0.1 * u, 0.2 * u, 0.9 * u, to.z}}}};
  }
  const MaterialId floor = scenes::add(scene, scenes::matte({0.3, 0.4, 0.6}));
  scenes::add(scene, Triangle{{{at(-4, -1.5, -3), at(4, -1.5, -3), at(0, -1.5, 6)}}, {}, {}}, floor);
  const MaterialId mirror = scenes::add(scene, scenes::mirror(0.7));
  scenes::add(scene, Triangle{{{at(-4, -1.4, -2.5), at(4, -1.4, -2.2), at(0, 4, -2.4)}}, {}, {}}, mirror);
  return scene;
}

/// The first are around everything, and glow; the others are beside it.
Shape far_shape(int kind, double size) {
  switch (kind) {
    case 0:
      return Sphere{{0, 0, 0}, size};
    case 1:
      return Box{{-size, -size, -size}, {size, size, size}};
    case 2:
      return scenes::placed(scenes::icosphere(1), size, {0, 0, 0});
    case 3:
      return Sphere{{2 * size, size, -3 * size}, size};
    case 4:
      return Cylinder{{-size, -2 * size, size}, {size, -2 * size, -size}, size / 2, true, {}};
    default:
      return Triangle{{{{size, size, -2 * size}, {-size, size, -3 * size}, {0, 3 * size, -size}}}, {}, {}};
  }
}

TEST(ScaleRatio, DoesNotChangeWhatIsSmall) {
  Row row(1, "extent 1e3 to 1e30 times an object's size: as without the rest", Oracle::invariance, "pixels");
  const Color glow{0, 0.5, 0.25};
  for (int kind = 0; kind < shape_kinds; ++kind)
    for (const Vec3& place : {Vec3{0, 0, 0}, Vec3{3, -2, 1}, Vec3{700, 40, -90}})
      for (const double unit : {1.0, 1e-6})
        for (const bool is_around : {true, false}) {
          Scene alone = small_scene(kind, place, unit);
          if (is_around) alone.background.color = glow;
          const Image expected = stability::render(alone).image;
          for (int far = is_around ? 0 : enclosures; far < (is_around ? enclosures : far_kinds); ++far)
            for (const double ratio : ratios) {
              if (ratio < 1e4 && place.x > 100) continue;  // it would be outside
              Scene scene = small_scene(kind, place, unit);
              scenes::add(scene, far_shape(far, 10 * ratio * unit), scenes::glowing(is_around ? glow : Color{}));
              const Image image = stability::render(scene).image;
              for (std::size_t i = 0; i < image.rgb.size(); ++i)
                row.expect(std::abs(image.rgb[i] - expected.rgb[i]) <= 1e-5,
                           "shape " + std::to_string(kind) + " with " + std::to_string(far) + " at " +
                               std::to_string(ratio) + " from " + std::to_string(place.x));
            }
        }
}

TEST(ScaleRatio, GivesTheImageOfLongDouble) {
  Row row(1, "small and large objects in view: the image of long double", Oracle::closed_form, "pixels");
  row.bound("the path passes an edge by less than 1e-7", 1e-3);
  for (const int kind : {0, 6, 7})
    for (const double unit : {1.0, 1e-6})
      for (const double ratio : ratios) {
        if (ratio < 1e7) continue;
        Scene scene = small_scene(kind, {0.5, 0.25, 0}, unit);
        const double size = ratio * unit;
        scenes::add(scene, Sphere{{size, 0, -3 * size}, size}, scenes::glowing({0, 0.3, 0.9}));
        scenes::add(
            scene,
            Triangle{{{{-4 * size, -size, -5 * size}, {size, -size, -5 * size}, {0, 3 * size, -4 * size}}}, {}, {}},
            scenes::glowing({0.2, 0.9, 0}));
        compare_with_reference(row, scene, {.absolute = 1e-5L, .edge = 1e-7L},
                               "shape " + std::to_string(kind) + " at " + std::to_string(ratio));
      }
}

}  // namespace
