// Two parallel mirrors: every path is endless, and the radiance is a geometric series.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/property/global_radiance.h"

namespace tracer {
namespace {

constexpr double whole = 0.5;

/// Two parallel mirrors that emit, seen from between them. The radiance is `whole` in every direction.
Scene mirror_hall(double reflection) {
  Scene scene = scenes::empty(12);
  scene.camera = {{0, 3, 0}, {0, 0, 0}, {0, 0, 1}, 40};
  Material wall = scenes::mirror(reflection);
  const double emission = whole * (1 - reflection);
  wall.emission = Color{emission, emission, emission};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, wall);
  scenes::add(scene, Plane{{0, 6, 0}, {0, 1, 0}, {}}, MaterialId{0});
  return scene;
}

/// The defaults of a document with a target error.
Scene with_target(Scene scene, double target) {
  scene.accuracy = {};
  scene.accuracy.adaptive.emplace().target_error = target;
  scene.accuracy.cutoff_by_chance = true;
  scene.accuracy.max_depth = default_max_depth(true);
  return scene;
}

TEST(MirrorHall, ReachesItsTargetWithoutAChargeForDepth) {
  for (const double target : {4.0, 1.0, 0.5}) {
    const Rendered rendered = scenes::render(with_target(mirror_hall(0.95), target));
    EXPECT_EQ(rendered.statistics.truncated_branches, 0u);
    EXPECT_EQ(rendered.statistics.cut_branches, rendered.statistics.samples) << "Russian roulette ends every path";
    EXPECT_EQ(rendered.error.depth, 0);
    EXPECT_EQ(rendered.error.cutoff, 0);
    EXPECT_TRUE(rendered.error.target_met) << rendered.error.estimate;
    Image exact = rendered.image;
    std::ranges::fill(exact.rgb, static_cast<float>(whole));
    EXPECT_LE(compare(to_display(exact), to_display(rendered.image))->rmse, rendered.error.estimate) << target;
  }
}

TEST(MirrorHall, IsChargedTheRestOfTheSeriesAtALowerDepth) {
  Scene scene = with_target(mirror_hall(0.95), 1);
  scene.accuracy.max_depth = 64;
  const Rendered rendered = scenes::render(scene);
  // The first 64 reflections add up to whole (1 - r^65); the bound of the rest is whole r^65, which is exact here.
  const double rest = whole * std::pow(0.95, 65);
  EXPECT_FLOAT_EQ(rendered.image.rgb[0], static_cast<float>(whole - rest));
  EXPECT_NEAR(rendered.error.depth, level_of(whole) - level_of(whole - rest), 2e-3);
  EXPECT_FALSE(rendered.error.target_met);
}

/// The charge for depth of a hall with a lamp of that height, below its floor or above.
double charge_with_lamp(double height, const std::function<void(Scene&)>& change = {}) {
  Scene scene = mirror_hall(0.95);
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
  const Rendered rendered = scenes::render(with_target(mirror_hall(1), 1));
  EXPECT_EQ(rendered.statistics.rays.reflection, 1000 * rendered.statistics.samples);
  EXPECT_EQ(rendered.statistics.truncated_branches, rendered.statistics.samples);
}

TEST(CutoffByChance, HasTheMeanOfTheImageWithoutACutoff) {
  Scene scene = mirror_hall(0.5);
  scene.accuracy.cutoff = 0.125;  // a weight equal to the cutoff is traced
  const Rendered plain = scenes::render(scene);
  const double kept = whole * (1 - std::pow(0.5, 4));  // 1, 1/2, 1/4, 1/8 | 1/16
  for (const float value : plain.image.rgb) EXPECT_FLOAT_EQ(value, static_cast<float>(kept));
  EXPECT_GT(plain.error.cutoff, 0);
  scene.accuracy.cutoff_by_chance = true;
  EXPECT_EQ(scenes::render(scene).error.cutoff, 0) << "nothing is missing in the mean";
  const Mean found = radiance(scene, 100);
  EXPECT_GT(found.error, 0) << "nothing was left to chance";
  EXPECT_LT(std::abs(found.value - whole), 4 * found.error) << found.value << " of " << whole;
  EXPECT_GT(whole - kept, 20 * found.error) << "the test could not tell them apart";
}

TEST(CutoffByChance, ChangesNothingWhereNoBranchIsBelowTheCutoff) {
  Scene scene = mirror_hall(0.5);
  scene.accuracy.max_depth = 5;
  const Rendered plain = scenes::render(scene);
  scene.accuracy.cutoff_by_chance = true;
  const Rendered by_chance = scenes::render(scene);
  EXPECT_EQ(by_chance.image.rgb, plain.image.rgb);
  EXPECT_EQ(by_chance.statistics, plain.statistics);
  EXPECT_EQ(by_chance.error.estimate, plain.error.estimate);
}

}  // namespace
}  // namespace tracer
