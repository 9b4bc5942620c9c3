// Progress, cancellation, and the counters of a render.
#include <gtest/gtest.h>

#include <thread>

#include "tests/support/scenes.h"
#include "tracer/compile.h"

namespace {

using namespace tracer;

/// Minutes of work, so that a test always cancels it before its end.
Scene endless() {
  Scene scene = scenes::empty(512, {{0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 40});
  scenes::add(scene, Sphere{{0, 0, 0}, 10}, scenes::mirror());
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::mirror());
  scene.accuracy.max_depth = 100'000;
  scene.accuracy.samples = 64;
  return scene;
}

TEST(Cancellation, BeforeTheStartReturnsAtOnceAndTracesNothing) {
  RenderControl control;
  control.cancel();
  control.cancel();
  const auto nothing = compile(endless(), control);
  ASSERT_FALSE(nothing.has_value());
  EXPECT_EQ(nothing.error().code, Failure::Code::cancelled);
  const auto image = render(*scenes::compiled(endless()), {.threads = 2}, control);
  ASSERT_FALSE(image.has_value());
  EXPECT_EQ(image.error().code, Failure::Code::cancelled);
  EXPECT_EQ(control.tiles_done(), 0u);
}

TEST(Cancellation, DuringTheRenderStopsItWithoutAnImage) {
  const auto scene = scenes::compiled(endless());
  for (const std::uint32_t threads : {1u, 2u, 0u}) {
    RenderControl control;
    std::thread someone([&] {
      while (control.tiles_total() == 0) std::this_thread::yield();
      control.cancel();
    });
    const auto image = render(*scene, {.threads = threads}, control);
    someone.join();
    ASSERT_FALSE(image.has_value());
    EXPECT_EQ(image.error().code, Failure::Code::cancelled);
    EXPECT_LT(control.tiles_done(), control.tiles_total());
  }
}

TEST(Cancellation, AtAnyMomentOfACompileGivesASceneOrNone) {
  Scene scene = scenes::empty(8);
  scenes::add(scene, scenes::icosphere(6, true), scenes::glass());
  int stopped = 0;
  for (int round = 0; round < 40; ++round) {
    RenderControl control;
    std::thread someone([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(1'000 * round));
      control.cancel();
    });
    const auto result = compile(scene, control);
    someone.join();
    if (result.has_value()) continue;
    ++stopped;
    EXPECT_EQ(result.error().code, Failure::Code::cancelled) << result.error().detail;
  }
  EXPECT_GT(stopped, 0) << "the first round cancels at once";
}

TEST(Progress, OnlyGrowsAndReachesItsTotal) {
  Scene scene = scenes::random(2, 200);
  scene.accuracy.samples = 8;
  const auto prepared = scenes::compiled(scene);
  RenderControl control;
  EXPECT_EQ(control.tiles_total(), 0u);
  std::atomic<bool> ended{false};
  std::uint64_t fell = 0;
  std::thread watcher([&] {
    std::uint64_t last = 0;
    while (!ended) {
      const std::uint64_t done = control.tiles_done();
      fell += done < last ? 1 : 0;
      last = done;
    }
  });
  const auto image = render(*prepared, {.threads = 2}, control);
  ended = true;
  watcher.join();
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(fell, 0u);
  EXPECT_GT(control.tiles_total(), 1u);
  EXPECT_EQ(control.tiles_done(), control.tiles_total());
}

TEST(Render, OfOneCompiledSceneConcurrentlyGivesTheSameImage) {
  const auto scene = scenes::compiled(scenes::random(6, 64));
  RenderControl control;
  const auto expected = render(*scene, {.threads = 1}, control);
  std::vector<std::jthread> threads(4);
  for (std::jthread& thread : threads)
    thread = std::jthread([&] {
      RenderControl own;
      EXPECT_EQ(render(*scene, {.threads = 0}, own)->image.rgb, expected->image.rgb);
    });
}

// ---- counts --------------------------------------------------------------------------------------------------------

/// A floor that fills the image.
Scene floor_scene(const Material& material) {
  Scene scene = scenes::empty(20, {{0, 5, 0}, {0, 0, 0}, {0, 0, 1}, 40});
  scene.lights = {scenes::point_light({0, 9, 0}), scenes::directional_light({0, -1, 0.1})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, material);
  return scene;
}

TEST(RayCounts, AreOneShadowRayPerLightOnTheFrontSide) {
  const auto expect_shadow_rays = [](std::uint64_t of_a_pixel, const Scene& scene, const char* name) {
    constexpr std::uint64_t pixels = 20 * 20;
    const RayCounts expected{.camera = pixels, .shadow = of_a_pixel * pixels};
    EXPECT_EQ(scenes::render(scene).statistics.rays, expected) << name;
  };
  Scene scene = floor_scene(scenes::matte({1, 1, 1}));
  expect_shadow_rays(2, scene, "two lights");
  scene.lights[0].shadows = false;
  expect_shadow_rays(1, scene, "a light without shadows");
  scene.lights[1].source = DirectionalLight{{0, 1, 0}};
  expect_shadow_rays(0, scene, "behind the surface");
  scene.lights[1] = {.source = DirectionalLight{{0, -1, 0}}, .intensity = 0};
  expect_shadow_rays(0, scene, "dark");
  expect_shadow_rays(0, floor_scene(scenes::glowing({1, 1, 1})), "a surface that reflects no light");
}

}  // namespace
