#include "tracer/src/certify/pixel_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/effort.h"
#include "tests/support/scenes.h"
#include "tests/unit/certify/random_scene.h"
#include "tracer/compile.h"
#include "tracer/src/parallel/parallel_for.h"

namespace {

using namespace tracer;

using Intervals = std::vector<RadianceInterval>;

Intervals intervals_of(const Scene& scene, const Assets& assets = {}, const InParallel& order = certify::one_by_one) {
  RenderControl control;
  return certify::intervals_of(**compile(scene, control, assets), order, control);
}

/// Expects that all pixels have this interval.
void expect_everywhere(const Scene& scene, const std::array<float, 3>& low, const std::array<float, 3>& high) {
  for (const RadianceInterval& interval : intervals_of(scene)) {
    EXPECT_EQ(interval.low, low);
    EXPECT_EQ(interval.high, high);
  }
}

bool is_dark(const RadianceInterval& interval) { return interval.high[0] == 0; }
bool is_lit(const RadianceInterval& interval) { return interval.low[0] > 0.3f; }
bool is_dark_or_lit(const RadianceInterval& interval) { return interval.low[0] == 0 && interval.high[0] > 0.3f; }

/// A camera at (0, 3, 6) that sees nothing but the plane y = 0, or what lies on it.
Scene floor_scene(std::uint32_t side = 16, const Material& material = scenes::matte({0.5, 0.5, 0.5})) {
  Scene scene = scenes::empty(side, {{0, 3, 6}, {0, 0, 0}, {0, 1, 0}, 20});
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, material);
  return scene;
}

float width(const RadianceInterval& interval) { return interval.high[0] - interval.low[0]; }

TEST(PixelBounds, ContainEverySampleOfRandomScenes) {
  std::uint64_t samples = 0;
  for (std::uint64_t seed = 0; seed < effort::cases(8'000); ++seed) {
    const certify::Comparison found = certify::compare(certify::random_scene(seed), 16, seed);
    EXPECT_EQ(found.outside, 0u) << "seed " << seed << ": first " << found.first;
    samples += found.samples;
  }
  EXPECT_GE(samples, 1'000'000u);
}

/// The comparison finds intervals that are too small: each bound moved inwards by a thousandth of its width and more.
TEST(PixelBounds, ComparisonFindsIntervalsThatAreTooSmall) {
  Scene scene = floor_scene();
  scene.lights.push_back(scenes::point_light({1, 2, 1}));
  RenderControl control;
  const auto compiled = compile(scene, control);
  auto intervals = certify::intervals_of(**compiled, certify::one_by_one, control);
  EXPECT_EQ(certify::compare(**compiled, intervals, 16, 1).outside, 0u);
  for (RadianceInterval& interval : intervals) interval.high[1] -= 0.25f * width(interval);
  EXPECT_GT(certify::compare(**compiled, intervals, 16, 1).outside, 0u);
}

TEST(PixelBounds, AreExactForTheBackground) {
  Scene scene = scenes::empty(40);
  scene.background.color = {0.25, 0.5, 2};
  expect_everywhere(scene, {0.25f, 0.5f, 2}, {0.25f, 0.5f, 2});
}

TEST(PixelBounds, AreExactForAnEmissiveSquareAndItsSurroundings) {
  Scene scene = scenes::empty(64, {{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 40});
  scene.background.color = {0.5, 0.5, 0.5};
  scenes::add(scene, Box{{-0.5, -0.5, -1}, {0.5, 0.5, 0}}, scenes::glowing({3, 3, 3}));
  std::size_t inside = 0, outside = 0, edges = 0;
  for (const RadianceInterval& interval : intervals_of(scene)) {
    inside += interval.low[0] == 3 && interval.high[0] == 3 ? 1 : 0;
    outside += interval.low[0] == 0.5f && interval.high[0] == 0.5f ? 1 : 0;
    edges += interval.low[0] == 0.5f && interval.high[0] == 3 ? 1 : 0;
  }
  // The side of the square is 64 / (2 * 4 tan 20) = 21.98 pixels.
  EXPECT_EQ(inside, 20u * 20);
  EXPECT_EQ(edges, 22u * 22 - 20 * 20);
  EXPECT_EQ(inside + outside + edges, 64u * 64);
}

TEST(PixelBounds, OfAnUnlitPlaneAreItsAmbientTerm) {
  Scene scene = floor_scene();
  scene.ambient = {0.5, 0.5, 0.5};
  expect_everywhere(scene, {0.25f, 0.25f, 0.25f}, {0.25f, 0.25f, 0.25f});
}

/// N.L / d^2 of a light above the plane at the corners of each pixel: the extremes over the pixel are there, or nearest
/// to the light.
TEST(PixelBounds, OfALitPlaneAreNarrow) {
  Scene scene = floor_scene(320);
  scene.lights.push_back(scenes::point_light({0.5, 2, -0.5}));
  for (const RadianceInterval& interval : intervals_of(scene)) {
    EXPECT_LT(width(interval), 3.0f / 255);
    EXPECT_GT(interval.low[0], 0.0f);
  }
}

TEST(PixelBounds, OfAShadowedPlaneAreDark) {
  Scene scene = floor_scene(64);
  scene.lights.push_back(scenes::point_light({0, 50, 0}));
  scenes::add(scene, Disc{{0, 40, 0}, {0, 1, 0}, 30, 0, {}}, scenes::matte({1, 1, 1}));
  expect_everywhere(scene, {}, {});
}

TEST(PixelBounds, OfAPenumbraReachFromDarkToLit) {
  Scene scene = floor_scene(64);
  scene.lights.push_back(scenes::point_light({0, 4, 0}));
  scenes::add(scene, Sphere{{0, 3.2, 0}, 0.05, {0, 1, 0}, {1, 0, 0}}, scenes::matte({1, 1, 1}));
  const Intervals intervals = intervals_of(scene);
  const auto dark = std::ranges::count_if(intervals, is_dark),
             either = std::ranges::count_if(intervals, is_dark_or_lit);
  EXPECT_GT(dark, 30);
  EXPECT_GT(either, 10);
  EXPECT_LT(either, 200);
  EXPECT_EQ(dark + either + std::ranges::count_if(intervals, is_lit), 64 * 64);
}

/// A triangle in the shadow of another, at the edge of it, and lit beside it.
TEST(PixelBounds, OfATriangleBelowAnotherContainEverySample) {
  Scene scene = scenes::empty(64, {{0, 3, 6}, {0, 0, 0}, {0, 1, 0}, 20});
  scene.lights.push_back(scenes::point_light({0, 4, 0}));
  const MaterialId white = scenes::add(scene, scenes::matte({0.5, 0.5, 0.5}));
  scenes::add(scene, Triangle{{Vec3{-30, 0, 20}, Vec3{30, 0, 20}, Vec3{0, 0, -40}}, {}, {}}, white);
  scenes::add(scene, Triangle{{Vec3{-0.2, 3, 0.1}, Vec3{0.2, 3, 0.1}, Vec3{0, 3, -0.3}}, {}, {}}, white);
  EXPECT_EQ(certify::compare({scene, {}}, 16, 5).outside, 0u);
  const Intervals intervals = intervals_of(scene);
  EXPECT_GT(std::ranges::count_if(intervals, is_dark), 100);
  EXPECT_GT(std::ranges::count_if(intervals, is_lit), 1000);
}

/// From inside, a sphere shadows itself.
TEST(PixelBounds, OfTheInsideOfASphereAreDark) {
  Scene scene = scenes::empty(32, {{0, 0, 0.5}, {0, 0, 0}, {0, 1, 0}, 60});
  scene.lights.push_back(scenes::point_light({0.5, 1, 5}));
  scenes::add(scene, Sphere{}, scenes::matte({0.5, 0.5, 0.5}));
  for (const RadianceInterval& interval : intervals_of(scene)) EXPECT_EQ(interval.low[0], 0.0f);
  scene.lights[0].source = PointLight{{0.2, 0.1, 0.3}};
  for (const RadianceInterval& interval : intervals_of(scene)) EXPECT_GT(interval.high[0], 0.1f);
}

/// The brightest surface of the scene may be reflected anywhere.
TEST(PixelBounds, OfAMirrorReachToTheBoundOfTheScene) {
  Scene scene = floor_scene(16, scenes::mirror(0.5));
  scenes::add(scene, Plane{{0, 0, -30}, {0, 0, 1}, {}}, scenes::glowing({1, 1, 1}));
  for (const RadianceInterval& interval : intervals_of(scene)) {
    EXPECT_EQ(interval.low[0], 0.0f);
    EXPECT_NEAR(interval.high[0], 0.5f, 1e-6);
  }
}

/// Tiles that are bounded in a hurry have the interval of the whole scene.
TEST(PixelBounds, OfAHurryAreThoseOfTheScene) {
  Scene scene = floor_scene();
  scene.background.color = {0.25, 0.25, 0.25};
  RenderControl control;
  const auto compiled = compile(scene, control);
  std::size_t pixels = 0;
  bound_pixels(
      **compiled, certify::one_by_one, control, [] { return true; },
      [&](std::size_t, const RadianceInterval& interval) {
        ++pixels;
        EXPECT_EQ(interval.low[0], 0.0f);
        EXPECT_EQ(interval.high[0], 0.25f);
      });
  EXPECT_EQ(pixels, 16u * 16);
}

TEST(PixelBounds, AreInfiniteWithoutABound) {
  Scene scene = floor_scene();
  scene.lights.push_back(scenes::point_light({0, 0.01, 0}));
  scene.lights[0].attenuation.kind = Attenuation::Kind::inverse_square;
  Material mirror = scenes::mirror(1);
  scenes::add(scene, Sphere{{0, 1.5, 0}, 0.2, {0, 1, 0}, {1, 0, 0}}, mirror);
  std::size_t infinite = 0;
  for (const RadianceInterval& interval : intervals_of(scene)) infinite += std::isinf(interval.high[0]) ? 1 : 0;
  EXPECT_GT(infinite, 0u);
}

TEST(PixelBounds, DoNotDependOnThreads) {
  const InParallel threads = [](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
    for_each_tile(count, 3, work);
  };
  certify::RandomScene random = certify::random_scene(12);
  random.scene.image = {200, 150};
  const Intervals first = intervals_of(random.scene, random.assets);
  const Intervals second = intervals_of(random.scene, random.assets, threads);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].low, second[i].low);
    EXPECT_EQ(first[i].high, second[i].high);
  }
}

TEST(PixelBounds, OfACropEqualThoseOfTheImage) {
  certify::RandomScene random = certify::random_scene(7);
  random.scene.image = {60, 50};
  const Intervals whole = intervals_of(random.scene, random.assets);
  random.scene.image.crop = PixelWindow{32, 32, 60, 50};
  const Intervals part = intervals_of(random.scene, random.assets);
  ASSERT_EQ(part.size(), 28u * 18);
  for (std::size_t y = 0; y < 18; ++y)
    for (std::size_t x = 0; x < 28; ++x) EXPECT_EQ(part[y * 28 + x].high, whole[(y + 32) * 60 + x + 32].high);
}

TEST(PixelBounds, AreLeftOutAfterCancellation) {
  RenderControl control;
  const auto compiled = compile(floor_scene(), control);
  control.cancel();
  for (const RadianceInterval& interval : certify::intervals_of(**compiled, certify::one_by_one, control))
    EXPECT_EQ(interval.high[0], 0.0f);
}

}  // namespace
