// Features thinner than pixels: which are found, and what fixed samples miss of them.
#include "tracer/src/sampling/subpixel_features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/scenes.h"
#include "tracer/encode.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/sampling/image_error.h"

namespace tracer {
namespace {

/// A scene of 32 x 32 pixels, a pixel for each unit of length in the plane z = 0.
Scene flat_scene() {
  Scene scene = scenes::empty(32);
  scene.camera = {{0, 0, 1000}, {0, 0, 0}, {0, 1, 0}, 2 * std::atan(16.0 / 1000) * 180 / std::numbers::pi};
  return scene;
}

std::vector<SubpixelFeature> features_of(const Scene& scene, std::size_t count_max = 1000) {
  RenderControl control;
  const auto compiled = compile(scene, control);
  return find_subpixel_features(**compiled, count_max);
}

/// Square with the center (x, y).
Mesh square(double x, double y, double side) {
  const double h = side / 2;
  Mesh mesh;
  mesh.positions = {{x - h, y - h, 0}, {x + h, y - h, 0}, {x + h, y + h, 0}, {x - h, y + h, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST(SubpixelFeatures, AreSmallObjects) {
  Scene scene = flat_scene();
  scenes::add(scene, square(0.5, 0.5, 0.1), scenes::glowing({1, 1, 1}));
  const auto features = features_of(scene);
  ASSERT_FALSE(features.empty());
  for (const SubpixelFeature& feature : features) {
    EXPECT_EQ(feature.x, 16u);
    EXPECT_EQ(feature.y, 15u);
    EXPECT_NEAR(feature.at.x, 0.5, 0.08);
    EXPECT_NEAR(feature.at.y, 0.5, 0.08);
    EXPECT_GT(feature.share, 0.003);
    EXPECT_LT(feature.share, 0.03);
    EXPECT_EQ(feature.count, 1);
  }
}

/// A white texel in a black environment, in balls around the view: one sample at its image in each shows it, and one at
/// most of its images in two balls.
TEST(SubpixelFeatures, AreImagesOfTheSunInMirrorBalls) {
  Scene scene = flat_scene();
  scene.camera = {{0, 3, 20}, {0, 0, 0}, {0, 1, 0}, 40};
  Image sky{256, 128, std::vector<float>(3 * 256 * 128, 0)};
  std::fill_n(sky.rgb.begin() + 3 * (30 * 256 + 100), 3, 1.0F);
  scene.assets = {{"sky.exr", "/background/environment/file"}};
  scene.textures = {{.pattern = ImageTexture{AssetId{0}, ColorSpace::linear}, .path = {}}};
  scene.background.environment = Environment{TextureId{0}, 70};
  const MaterialId mirror = scenes::add(scene, scenes::mirror(1));
  for (int i = 0; i < 9; ++i)
    scenes::add(scene, Sphere{{-4.0 + i, 0.3 * i - 1, 0.5 * i}, i % 2 == 0 ? 0.3 : 0.02}, mirror);
  RenderControl control;
  const auto compiled = compile(scene, control, {{encode(sky, Format::exr)->bytes}});
  ASSERT_TRUE(compiled);
  const auto features = find_subpixel_features(**compiled, 1000, true);
  TracerPool<> pool(make_wavefront, **compiled, control, {});
  const InParallel in_order = [](std::uint64_t count, const auto& work) {
    for (std::uint64_t i = 0; i < count; ++i) work(i);
  };
  std::size_t bright = 0;
  for (const Color& found : sample_features(features, **compiled, pool, in_order, [] { return false; }))
    bright += found.r > 0.5 ? 1 : 0;
  EXPECT_GE(bright, 9u + 20u) << features.size() << ": balls hide some of the images in two balls";
}

/// The middle of its longest edge is not inside.
TEST(SubpixelFeatures, LieInsideOfTriangles) {
  Scene scene = flat_scene();
  scenes::add(scene, Triangle{{Vec3{0.3, 0.3, 0}, Vec3{0.7, 0.3, 0}, Vec3{0.3, 0.6, 0}}, {}, {}},
              scenes::glowing({1, 1, 1}));
  const auto features = features_of(scene);
  ASSERT_FALSE(features.empty());
  std::size_t inside = 0;
  for (const SubpixelFeature& feature : features) {
    const double u = (feature.at.x - 0.3) / 0.4, v = (0.7 - feature.at.y) / 0.3;  // rows count from the top
    inside += u > 0 && v > 0 && u + v < 1 ? 1 : 0;
  }
  EXPECT_GE(2 * inside, features.size());
}

/// Squares that one mesh consists of are features each; triangles that are connected by position only are one surface.
TEST(SubpixelFeatures, AreConnected) {
  Scene scene = flat_scene();
  Mesh squares;
  for (int i = 0; i < 20; ++i)
    for (const Mesh one = square(i - 9.5, 0.5, 0.1); const auto& triangle : one.triangles) {
      for (const std::uint32_t vertex : triangle) squares.positions.push_back(one.positions[vertex]);
      const auto last = static_cast<std::uint32_t>(squares.positions.size());
      squares.triangles.push_back({last - 3, last - 2, last - 1});
    }
  scenes::add(scene, squares, scenes::glowing({1, 1, 1}));
  const Mesh sphere = scenes::placed(scenes::icosphere(2), 5, {0, 0, -9});
  const MaterialId white = scenes::add(scene, scenes::matte({1, 1, 1}));
  for (const auto& [a, b, c] : sphere.triangles)
    scenes::add(scene, Triangle{{sphere.positions[a], sphere.positions[b], sphere.positions[c]}, {}, {}}, white);
  std::vector<std::size_t> columns(32);
  for (const SubpixelFeature& feature : features_of(scene)) {
    EXPECT_EQ(feature.y, 15u);
    ++columns[feature.x];
  }
  for (std::size_t x = 0; x < 32; ++x) EXPECT_EQ(columns[x] > 0, x >= 6 && x < 26) << x;
}

TEST(SubpixelFeatures, FollowThinTriangles) {
  Scene scene = flat_scene();
  scenes::add(scene, Triangle{{Vec3{-10.5, -10.5, 0}, Vec3{10.5, 10.5, 0}, Vec3{10.5, 10.6, 0}}, {}, {}},
              scenes::glowing({1, 1, 1}));
  std::vector<bool> rows(32);
  for (const SubpixelFeature& feature : features_of(scene)) rows[feature.y] = true;
  EXPECT_GE(std::count(rows.begin(), rows.end(), true), 21);
}

TEST(SubpixelFeatures, AreNeitherLargeNorPartsOfMeshes) {
  Scene scene = flat_scene();
  scenes::add(scene, square(0, 0, 20), scenes::glowing({1, 1, 1}));
  scenes::add(scene, scenes::placed(scenes::icosphere(4), 5, {0, 0, 0}), scenes::matte({1, 1, 1}));
  EXPECT_TRUE(features_of(scene).empty());
}

TEST(SubpixelFeatures, StandForOthersIfThereAreTooMany) {
  Scene scene = flat_scene();
  const MaterialId white = scenes::add(scene, scenes::glowing({1, 1, 1}));
  for (int row = 0; row < 30; ++row) {
    for (int column = 0; column < 30; ++column)
      scenes::add(scene, Sphere{{column - 14.5, row - 14.5, 0}, 0.01, {}}, white);
  }
  EXPECT_EQ(features_of(scene).size(), 900u);
  double sum = 0;
  const auto few = features_of(scene, 100);
  EXPECT_LE(few.size(), 100u);
  for (const SubpixelFeature& feature : few) sum += feature.count;
  EXPECT_NEAR(sum, 900, 10);
}

class MissedFeatures : public ::testing::Test {
 protected:
  std::vector<MissedFeature> missed(std::uint32_t samples, double deviation, double share = 0.1, double radiance = 1) {
    const std::vector<float> rgb(12, 0.25F), deviations(12, static_cast<float>(deviation));
    const std::vector<SubpixelFeature> features{{1, 1, {0.5, 0.5}, static_cast<float>(share), 2},
                                                {0, 1, {0.5, 0.5}, static_cast<float>(share), 1}};
    const std::vector<Color> colors(2, Color{radiance, 0.25, 0.25});
    return missed_features(features, colors, {rgb, deviations, 2, samples}, {0, 0, 2, 2}, display);
  }
  DisplayTransform display{{}, 1};
};

TEST_F(MissedFeatures, ChangeTheDisplayedPixel) {
  const auto found = missed(4, 0);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].place, 2u);
  EXPECT_EQ(found[1].place, 3u);
  const double with = 0.25 + 0.1 * 0.75, error = std::pow(display.level(with) - display.level(0.25), 2);
  EXPECT_NEAR(found[0].squared, error, 1e-3 * error);
  EXPECT_NEAR(found[1].squared, 2 * error, 1e-3 * error) << "stands for two";
  EXPECT_NEAR(found[0].brightest, with, 1e-6);
}

TEST_F(MissedFeatures, AreNotThoseThatWereHit) {
  EXPECT_TRUE(missed(4, 0.75 / 4).empty()) << "the halves differ by one hit";
  EXPECT_FALSE(missed(4, 0.01).empty());
  EXPECT_TRUE(missed(64, 0).empty()) << "it would have been hit six times";
  EXPECT_TRUE(missed(4, 0, 0.1, 0.25).empty()) << "it looks like the pixel";
  EXPECT_TRUE(missed(4, 0, 0.1, std::nan("")).empty());
}

/// One sample per pixel misses all of it, and the estimate has the error.
TEST(UniformSampler, IncludesTheErrorOfMissedFeatures) {
  Scene scene = flat_scene();
  scene.background.color = {0.1, 0.1, 0.1};
  scenes::add(scene, square(0.3, 0.3, 0.3), scenes::glowing({1, 1, 1}));
  const Rendered rendered = scenes::render(scene);
  for (const float value : rendered.image.rgb) ASSERT_EQ(value, 0.1F) << "no sample hits it";
  const DisplayTransform display({}, 1);
  const double truth = (display.level(0.1 + 0.09 * 0.9) - display.level(0.1)) / 32;
  EXPECT_GE(rendered.error.estimate, truth);
  EXPECT_LE(rendered.error.estimate, 4 * truth);
  EXPECT_EQ(rendered.statistics.samples, 32u * 32);
}

/// Reflected features are not searched: one of any height is suspected, so that an image of one color is not certain.
TEST(UniformSampler, SuspectsOneFeatureInAMirror) {
  Scene scene = flat_scene();
  scenes::add(scene, square(0, 0, 32), scenes::mirror());
  for (const std::uint32_t samples : {1u, 4u, 64u}) {
    scene.accuracy.samples = samples;
    const double missed = 255 * std::sqrt(0.75 / ((samples + 1) * (samples + 2)) / (3 * 32 * 32));
    EXPECT_NEAR(scenes::render(scene).error.estimate, missed * std::sqrt(1 + 2.33), 1e-6 * missed) << samples;
  }
  scene.materials[0] = scenes::glowing({1, 1, 1});
  EXPECT_EQ(scenes::render(scene).error.estimate, 0);
}

}  // namespace
}  // namespace tracer
