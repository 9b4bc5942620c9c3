// Two parallel mirrors: every path is endless, and the radiance is a geometric series.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/scenes.h"
#include "tracer/compare.h"

namespace tracer {
namespace {

/// Two parallel mirrors that emit, seen from between them. `whole` is the radiance in every direction.
struct MirrorHall {
  Scene scene;
  double whole;
};

MirrorHall mirror_hall(double reflection, double whole) {
  Scene scene = scenes::empty(12);
  scene.camera = {{0, 3, 0}, {0, 0, 0}, {0, 0, 1}, 40};
  Material wall = scenes::mirror(reflection);
  const double emission = whole * (1 - reflection);
  wall.emission = Color{emission, emission, emission};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, wall);
  scenes::add(scene, Plane{{0, 6, 0}, {0, 1, 0}, {}}, MaterialId{0});
  return {scene, whole};
}

/// The defaults of a document with a target error.
Scene with_target(Scene scene, double target) {
  scene.accuracy = {};
  scene.accuracy.adaptive.emplace().target_error = target;
  scene.accuracy.cutoff_by_chance = true;
  scene.accuracy.max_depth = default_max_depth(true);
  return scene;
}

double level_of(double radiance) {
  const auto value = static_cast<float>(radiance);
  return to_display({.width = 1, .height = 1, .rgb = {value, value, value}}).codes[0] / codes_per_level;
}

TEST(MirrorHall, ReachesItsTargetWithoutAChargeForDepth) {
  const MirrorHall hall = mirror_hall(0.95, 0.5);
  for (const double target : {4.0, 1.0, 0.5}) {
    const Rendered rendered = scenes::render(with_target(hall.scene, target));
    EXPECT_EQ(rendered.statistics.truncated_branches, 0u);
    EXPECT_EQ(rendered.statistics.cut_branches, rendered.statistics.samples) << "Russian roulette ends every path";
    EXPECT_EQ(rendered.error.depth, 0);
    EXPECT_EQ(rendered.error.cutoff, 0);
    EXPECT_TRUE(rendered.error.target_met) << rendered.error.estimate;
    double squared = 0;
    for (const float value : rendered.image.rgb) squared += std::pow(level_of(value) - level_of(hall.whole), 2);
    const double error = std::sqrt(squared / static_cast<double>(rendered.image.rgb.size()));
    EXPECT_LE(error, rendered.error.estimate) << "target " << target;
  }
}

TEST(MirrorHall, IsChargedTheRestOfTheSeriesAtALowerDepth) {
  const MirrorHall hall = mirror_hall(0.95, 0.5);
  Scene scene = with_target(hall.scene, 1);
  scene.accuracy.max_depth = 64;
  const Rendered rendered = scenes::render(scene);
  // The first 64 reflections add up to whole (1 - r^65); the bound of the rest is whole r^65, which is exact here.
  const double rest = hall.whole * std::pow(0.95, 65);
  EXPECT_FLOAT_EQ(rendered.image.rgb[0], static_cast<float>(hall.whole - rest));
  EXPECT_NEAR(rendered.error.depth, level_of(hall.whole) - level_of(hall.whole - rest), 2e-3);
  EXPECT_FALSE(rendered.error.target_met);
}

/// The charge for depth of a hall with a lamp of that height, below its floor or above.
double charge_with_lamp(double height, const std::function<void(Scene&)>& change = {}) {
  Scene scene = mirror_hall(0.95, 0.5).scene;
  scene.accuracy.max_depth = 64;
  scene.accuracy.samples = 4;
  if (!std::isnan(height)) scenes::add(scene, Sphere{{5, height, 0}, 1}, scenes::glowing({4, 4, 4}));
  if (change) change(scene);
  return scenes::render(scene).error.depth;
}

TEST(MirrorHall, IsNotChargedALampBehindAWall) {
  const double without = charge_with_lamp(std::nan(""));
  EXPECT_GT(without, 0);
  for (const double height : {-2.0, 8.0, -20.0}) EXPECT_DOUBLE_EQ(charge_with_lamp(height), without) << height;
}

/// True if a lamp of that height is in the charge for depth.
bool charges_lamp(double height, const std::function<void(Scene&)>& change = {}) {
  return charge_with_lamp(height, change) > 1.5 * charge_with_lamp(std::nan(""), change);
}

TEST(MirrorHall, IsChargedALampThatAPathMayReach) {
  const double below = -10;
  EXPECT_FALSE(charges_lamp(below));
  EXPECT_TRUE(charges_lamp(4));
  EXPECT_TRUE(charges_lamp(-0.5)) << "a part of the lamp is above the floor";
  EXPECT_TRUE(charges_lamp(below, [](Scene& scene) { scene.materials[0].transmission = 0.01; }));
  EXPECT_TRUE(charges_lamp(below, [](Scene& scene) { scene.materials[0].opacity = Color{0.98, 0.98, 0.98}; }));
  EXPECT_TRUE(charges_lamp(below, [](Scene& scene) {  // paths, which may have shadow rays toward any lamp
    scene.accuracy.model = Accuracy::Model::global;
    scenes::add(scene, Sphere{{-3, 3, 0}, 1}, scenes::matte({0.5, 0.5, 0.5}));
  }));
  EXPECT_TRUE(charges_lamp(below, [](Scene& scene) {  // turned normals may reflect through a wall
    scene.textures.emplace_back().pattern = NoiseTexture{};
    scene.materials[0].bump = Bump{{0}, 0.1};
  }));
}

TEST(MirrorHall, IsChargedALampIfARayStartsOnItsSide) {
  const auto charges = [](auto change) {
    return charges_lamp(-10, [=](Scene& scene) {
      scene.camera.position = {0, 2, 0};
      scene.camera.look_at = {3, 1, 0};
      scene.camera.up = {0, 1, 0};
      change(scene.camera);
    });
  };
  EXPECT_FALSE(charges([](Camera&) {}));
  EXPECT_TRUE(charges([](Camera& camera) { camera.aperture = 5; }));
  EXPECT_TRUE(charges([](Camera& camera) {
    camera.type = Camera::Type::orthographic;
    camera.height = 5;
  }));
  EXPECT_TRUE(charges([](Camera& camera) {
    camera.up = {0, 0, 1};
    camera.layout = Camera::Layout::anaglyph;
    camera.eye_separation = 5;
  }));
}

TEST(MirrorHall, EndsAtTheDefaultDepthBetweenPerfectMirrors) {
  Scene scene = mirror_hall(1, 0).scene;
  scene = with_target(scene, 1);
  const Rendered rendered = scenes::render(scene);
  EXPECT_EQ(rendered.statistics.rays.reflection, 1000 * rendered.statistics.samples);
  EXPECT_EQ(rendered.statistics.truncated_branches, rendered.statistics.samples);
}

}  // namespace
}  // namespace tracer
