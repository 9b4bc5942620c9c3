// Rays that end: by chance, without a change of the mean, or by `cutoff` and `max_depth`, whose error is measured.
#include "tracer/src/sampling/truncation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/property/global_radiance.h"
#include "tracer/compile.h"
#include "tracer/src/integrators/whitted/wavefront.h"

namespace tracer {
namespace {

constexpr double whole = 0.5;

/// A closed box of mirrors that emit, seen from inside: the radiance of every ray is `whole`, a geometric series.
Scene mirror_box(double reflection, std::uint32_t side = 8) {
  Scene scene = scenes::empty(side, {{0.3, -0.2, 0.1}, {1, 0.4, 0.2}, {0, 0, 1}, 60});
  Material wall = scenes::mirror(reflection);
  const double emission = whole * (1 - reflection);
  wall.emission = Color{emission, emission, emission};
  scenes::add(scene, Box{{-1, -1, -1}, {1, 1, 1}}, wall);
  return scene;
}

Scene without_limits(Scene scene) {
  scenes::end_by_chance(scene);
  return scene;
}

Scene with_target(Scene scene, double target) {
  scene.accuracy.adaptive.emplace().target_error = target;
  return scene;
}

/// Nested glass in a box that glows: what glass takes from one ray it gives to another.
Scene glass_in_a_furnace() {
  Scene scene = scenes::empty(16, {{0, -3, 0}, {0, 0, 0}, {0, 0, 1}, 45});
  scenes::add(scene, Box{{-4, -4, -4}, {4, 4, 4}}, scenes::glowing({whole, whole, whole}));
  for (const auto& [radius, ior] : {std::pair{1.0, 1.5}, {0.7, 1.2}, {0.4, 2.4}})
    scenes::add(scene, Sphere{{0, 0, 0}, radius}, scenes::glass(ior));
  return scene;
}

TEST(RussianRoulette, ChangesNoMean) {
  for (const auto& [scene, deviation] : {std::pair{mirror_box(0.5), 1e-3},
                                         {mirror_box(0.9), 1e-3},
                                         {mirror_box(0.95), 2e-3},
                                         {mirror_box(0.99), 0.03},
                                         {glass_in_a_furnace(), 1e-3}}) {
    const Mean found = radiance(without_limits(scene), 40);
    EXPECT_TRUE(found.error > 0 && found.error < deviation) << "chance decides, and not about much: " << found.error;
    EXPECT_NEAR(found.value, whole, 4 * found.error);
  }
}

TEST(RussianRoulette, LeavesNoErrorToDeclareWhereATargetIsReached) {
  for (const double target : {4.0, 1.0, 0.5}) {
    const Rendered rendered = scenes::render(with_target(without_limits(mirror_box(0.95, 12)), target));
    EXPECT_EQ(rendered.statistics.cut_branches, rendered.statistics.samples) << "every path ends by chance";
    EXPECT_EQ(rendered.error.depth + rendered.error.cutoff, 0);
    EXPECT_TRUE(rendered.error.target_met) << rendered.error.estimate;
    Image exact = rendered.image;
    std::ranges::fill(exact.rgb, static_cast<float>(whole));
    EXPECT_LE(compare(to_display(exact), to_display(rendered.image))->rmse, rendered.error.estimate) << target;
  }
}

TEST(RussianRoulette, EndsPathsBetweenPerfectMirrors) {
  const Scene fixed = without_limits(mirror_box(1, 64));
  for (const Scene& scene : {fixed, with_target(fixed, 1)}) {
    const RenderStatistics counts = scenes::render(scene).statistics;
    // From bounce n - 1 a path goes on with the probability 1 - 2 / n: as many bounces follow as were before.
    const double bounces = static_cast<double>(counts.rays.reflection) / static_cast<double>(counts.samples);
    EXPECT_NEAR(bounces, 2 * scene.accuracy.roulette_depth(), 0.1 * bounces);
  }
}

TEST(RussianRoulette, EndsPathsThatAMeshOfGlassTraps) {
  std::vector<double> per_camera_ray;
  for (const Shape& ball : {Shape(Sphere{{0, 0, 0}, 1}), Shape(scenes::icosphere(3, true))}) {
    Scene scene = without_limits(scenes::empty(64));
    scene.camera = {{0, -4, 0}, {0, 0, 0}, {0, 0, 1}, 32};
    scene.background.gradient = Gradient{{0, 0, 0}, {whole, whole, whole}};
    scenes::add(scene, ball, scenes::glass(1.5));
    const RayCounts rays = scenes::render(with_target(scene, 0.5)).statistics.rays;
    per_camera_ray.push_back(static_cast<double>(rays.total()) / static_cast<double>(rays.camera));
  }
  EXPECT_LT(per_camera_ray[1], 1.5 * per_camera_ray[0]);
}

TEST(RussianRoulette, EndsTreesAndPathsThatGainLight) {
  Scene tree = glass_in_a_furnace(), path = mirror_box(1);
  tree.materials[0] = scenes::mirror(1);
  for (Material& material : tree.materials) material.reflection_color = Color{1.05, 1.05, 1.05};
  path.materials[0].reflection_color = Color{1e25, 1e25, 1e25};
  for (Scene* const scene : {&tree, &path}) {
    scene->image = {2, 2, {}};
    scene->accuracy.max_depth.reset();
    scene->accuracy.cutoff.reset();
    const double rays = static_cast<double>(scenes::render(*scene).statistics.rays.total()) / 4;
    EXPECT_TRUE(rays >= 40 && rays < 100'000) << rays;
  }
}

// ---- rays that are continued

/// Those of all other rays are as they were: no sample has less light.
TEST(LiftedLimits, OnlyAddLight) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Scene scene = scenes::random(seed, 8);
    if (seed % 2 == 1) scenes::light_globally(scene);
    if (seed % 3 != 0) scene.accuracy.cutoff.reset();
    scene.accuracy.max_depth = 2;
    RenderControl control;
    const auto compiled = *compile(scene, control);
    Wavefront<AllFeatures> tracer(*compiled, control, {});
    for (std::uint32_t i = 0; i < 500; ++i)
      push(tracer.batch(), *compiled, fresh_sample(*compiled, i % 8, i / 8 % 8, i, 7));
    ASSERT_TRUE(tracer.trace());
    const std::vector<Color> with = tracer.radiance();
    tracer.batch().lifted = {seed % 3 == 0, true, 1e-3};
    ASSERT_TRUE(tracer.trace());
    for (std::size_t i = 0; i < with.size(); ++i)
      ASSERT_LE(with[i].g, tracer.radiance()[i].g * (1 + 1e-12)) << "scene " << seed;
  }
}

// ---- the error

TEST(TruncationError, IsTheRestOfTheSeriesAndEndsSamplingIfItForbidsTheTarget) {
  for (const bool by_cutoff : {false, true})
    for (const std::uint32_t bounces : {0, 1, 3, 12}) {
      Scene scene = mirror_box(0.5, 32);
      scene.accuracy.max_depth = by_cutoff ? std::nullopt : std::optional(bounces);
      scene.accuracy.cutoff = by_cutoff ? std::pow(0.5, bounces) : 0;  // a throughput equal to it is traced
      const double kept = whole * (1 - std::pow(0.5, bounces + 1)), truth = level_of(whole) - level_of(kept);
      const Rendered one = scenes::render(scene), adaptive = scenes::render(with_target(scene, truth / 2));
      for (const ErrorEstimate& error : {one.error, adaptive.error}) {
        EXPECT_GT(by_cutoff ? error.cutoff : error.depth, 0.8 * truth) << bounces;
        EXPECT_LT(by_cutoff ? error.cutoff : error.depth, 1.6 * truth) << bounces;
        EXPECT_EQ(by_cutoff ? error.depth : error.cutoff, 0);
      }
      EXPECT_FLOAT_EQ(one.image.rgb[0], static_cast<float>(kept));
      EXPECT_EQ(one.error.estimate, scenes::render(scene, 4).error.estimate);
      EXPECT_EQ(adaptive.error.limit, ErrorEstimate::Limit::fixed_parts);
      EXPECT_EQ(adaptive.statistics.samples_max, 1u);
    }
}

TEST(TruncationError, WithoutAFindIsThreeByTheNumberOfLooks) {
  EXPECT_DOUBLE_EQ(truncation_error(std::vector<double>(300), 500).squared_upper, 5);
  EXPECT_DOUBLE_EQ(truncation_error(std::vector<double>(2), 500).squared_upper, 500);
  EXPECT_EQ(truncation_error(std::vector<double>(300, 1000), 500).squared_upper, 500);
  Scene scene = scenes::empty(64, {{0, 3, 0}, {0, 0, 0}, {0, 0, 1}, 40});
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::mirror(0.5));
  scenes::add(scene, Sphere{{1000, 5, 0}, 1}, scenes::glowing({1, 1, 1}));  // no ray reflects to it
  scene.accuracy.max_depth = 0;
  const ErrorEstimate error = scenes::render(scene).error;
  EXPECT_GT(error.depth, 0);
  EXPECT_LT(error.depth, level_of(0.5) * std::sqrt(3.4 / static_cast<double>(error.looks)));
  scene.image = {256, 256, {}};
  EXPECT_TRUE(scenes::render(with_target(scene, 8)).error.target_met) << "more looks exclude more";
}

TEST(TruncationError, OfHostileDocumentsIsFinite) {
  const std::pair<std::optional<std::uint32_t>, std::optional<double>> limits[] = {
      {0, 0.0}, {64, 1.0}, {65'535, 0.0}, {64, 1e-300}, {std::nullopt, 0.0}};
  for (const double reflection : {0.5, 1.0, 1e25})
    for (const double emission : {0.0, 1e-30, 1e25})
      for (const auto& [max_depth, cutoff] : limits) {
        Scene scene = mirror_box(1, 2);
        scene.materials[0].reflection_color = Color{reflection, reflection, reflection};
        scene.materials[0].emission = Color{emission, emission, emission};
        scene.accuracy.max_depth = max_depth;
        scene.accuracy.cutoff = cutoff;
        const ErrorEstimate error = scenes::render(scene).error;
        EXPECT_TRUE(std::isfinite(error.estimate));
        EXPECT_TRUE(emission > 0 || reflection > 1 || error.depth + error.cutoff == 0) << "no light can be missing";
      }
}

}  // namespace
}  // namespace tracer
