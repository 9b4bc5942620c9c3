// Glass with the index of air or a million, a camera inside of glass, glass in layers of zero thickness.
#include <gtest/gtest.h>

#include <sstream>

#include "tests/stability/layers.h"
#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/pixel_ray.h"

namespace {

using oracle::Real;
using namespace tracer;
using stability::Oracle;
using stability::Row;

/// Half-spaces below the given heights, under a gradient background from 0 below to 1 above.
struct Layer {
  double top, ior;
  int priority = 0;
};

Scene half_spaces(const std::vector<Layer>& layers, const Vec3& eye, const Vec3& look_at, double fov_deg) {
  Scene scene = scenes::empty(48);
  scene.camera = {eye, look_at, {0, 1, 0}, fov_deg};
  scene.background.gradient = Gradient{{1, 1, 1}, {0, 0, 0}};
  scene.accuracy.max_depth = 100;
  for (const Layer& layer : layers) {
    Material glass = scenes::glass(layer.ior);
    glass.priority = layer.priority;
    scenes::add(scene, Plane{{0, layer.top, 0}, {0, 1, 0}, {}}, glass);
  }
  return scene;
}

/// Compares the image with the closed form; `indices` start with the camera's medium, in the direction of `down`.
void compare(Row& row, const Scene& scene, const std::vector<Real>& indices, bool down, const std::string& what) {
  const Image image = stability::render(scene).image;
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const Real height = oracle::through(scene, x, y).y, cos_i = std::fabs(height);
      Real expected = (1 + height) / 2;
      if ((height < 0) == down) {
        const stability::Layered layered = stability::through_layers(cos_i, indices);
        const Real side = down ? -1 : 1;
        expected = layered.back * (1 - side * cos_i) / 2 + layered.onward * (1 + side * layered.cos_onward) / 2;
      }
      row.expect(std::fabs(image.pixel(x, y)[0] - expected) <= 1e-6L,
                 what + " at " + std::to_string(x) + " " + std::to_string(y) + ": " +
                     std::to_string(image.pixel(x, y)[0]) + ", not " + std::to_string(expected));
    }
}

TEST(GlassOfExtremeIndex, ReflectsAndTransmitsByFresnelFromBothSides) {
  Row row(10, "ior 1 +- 1e-15, 1 +- 1e-9, 1e6, 1e-6, both sides", Oracle::closed_form, "pixels");
  for (const double ior : {1 + 1e-15, 1 - 1e-15, 1 + 1e-9, 1 - 1e-9, 1e6, 1e-6})
    for (const double fov : {150.0, 1e-3}) {
      const std::string what = "ior - 1 = " + std::to_string(ior - 1);
      compare(row, half_spaces({{0, ior}}, {0, 1, 0}, {0.1, 0, 0}, fov), {1, ior}, true, what + " from above");
      compare(row, half_spaces({{0, ior}}, {0, -1, 0}, {0.1, 0, 0}, fov), {ior, 1}, false, what + " from below");
    }
}

TEST(GlassOfExtremeIndex, IsInvisibleWithTheIndexOfAir) {
  Row row(10, "balls of ior 1, 1 +- 1e-15 are not there", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed)
    for (const double ior : {1.0, 1 + 1e-15, 1 - 1e-15}) {
      Scene without = scenes::random(seed, 40);
      for (Material& material : without.materials) {  // no other ray goes on behind a surface: 60 bounces do not branch
        material.transmission = 0;
        material.opacity = Color{1, 1, 1};
      }
      without.accuracy.max_depth = 60;
      Scene with = without;
      for (const Sphere& ball : {Sphere{{0, 0, 0}, 2}, Sphere{{1, 1, -1}, 0.7}, Sphere{{-1, 0.5, 1}, 1.1}})
        scenes::add(with, ball, scenes::glass(ior));
      const Image a = stability::render(with).image, b = stability::render(without).image;
      for (std::size_t i = 0; i < a.rgb.size(); ++i)
        row.expect(std::fabs(a.rgb[i] - b.rgb[i]) <= 1e-6F * (1 + b.rgb[i]), "seed " + std::to_string(seed));
    }
}

TEST(CameraInGlass, ReceivesTheFresnelTransmittanceThroughOneInterface) {
  Row row(12, "eye inside glass: one border, total reflection beyond the angle", Oracle::closed_form, "pixels");
  for (const double ior : {1.5, 2.4, 0.7, 1.0001})
    for (const double height : {1e-9, 1.0, 1e6})
      compare(row, half_spaces({{0, ior}}, {0, -height, 0}, {0.2 * height, 0, 0}, 140), {ior, 1}, false,
              "ior " + std::to_string(ior));
}

/// Compares the layers in the given and in the reverse order with the closed form for `indices`.
void compare_layers(Row& row, std::vector<Layer> layers, const std::vector<Real>& indices, const std::string& what) {
  for (const bool backwards : {false, true}) {
    if (backwards) std::reverse(layers.begin(), layers.end());
    Scene scene = half_spaces(layers, {0, 2, 0}, {0.5, 0, 0}, 60);
    scene.accuracy.cutoff = 1e-9;
    compare(row, scene, indices, true, what + (backwards ? ", backwards" : ""));
  }
}

TEST(LayersOfGlass, GiveOneImageForAnyThinGapOrOverlap) {
  Row row(15, "nested, hidden, parted, overlapping by 1 .. 1e-14: the limit's", Oracle::closed_form, "pixels");
  for (const double gap : {1.0, 1e-3, 1e-6, 1e-9, 1e-12, 1e-14}) {
    std::ostringstream text;
    text << " by " << gap;
    const std::string by = text.str();
    compare_layers(row, {{0, 1.5}, {-gap, 1.33, 1}}, {1, 1.5, 1.33}, "nested" + by);
    compare_layers(row, {{0, 1.5, 1}, {-gap, 1.33}}, {1, 1.5}, "hidden" + by);
    compare_layers(row, {{0, 1.5}, {-0.5, 1, 1}, {-0.5 - gap, 1.33, 2}}, {1, 1.5, 1, 1.33}, "parted" + by);
    compare_layers(row, {{gap, 1.33}, {0, 1.5, 1}}, {1, 1.33, 1.5}, "overlapping" + by);
  }
}

TEST(LayersOfGlass, AtTheSamePositionEqualTheFirstOne) {
  Row row(15, "borders in exactly one place: the first one's image", Oracle::closed_form, "pixels");
  row.note("not the limit's: no ray gets between them, so solids that touch must overlap by 1e-14 to be two");
  compare(row, half_spaces({{0, 1.5}, {0, 1.33, 1}}, {0, 2, 0}, {0.5, 0, 0}, 60), {1, 1.5}, true, "1.5 first");
  compare(row, half_spaces({{0, 1.33, 1}, {0, 1.5}}, {0, 2, 0}, {0.5, 0, 0}, 60), {1, 1.33}, true, "1.33 first");
}

TEST(LayersOfGlass, AreTheSameForBoxesAsForHalfSpaces) {
  Row row(15, "boxes side by side that overlap by 1 .. 1e-9", Oracle::closed_form, "pixels");
  for (const double overlap : {1.0, 1e-3, 1e-6, 1e-9}) {
    Scene scene = half_spaces({}, {0, 2, 0}, {0.05, 0, 0}, 30);
    scene.accuracy.cutoff = 1e-9;
    Material over = scenes::glass(1.5), under = scenes::glass(1.33);
    over.priority = 1;
    scenes::add(scene, Box{{-1e3, -2, -1e3}, {1e3, 0, 1e3}}, over);
    scenes::add(scene, Box{{-1e3, -4, -1e3}, {1e3, -2 + overlap, 1e3}}, under);
    compare(row, scene, {1, 1.5, 1.33, 1}, true, "overlap " + std::to_string(overlap));
  }
}

}  // namespace
