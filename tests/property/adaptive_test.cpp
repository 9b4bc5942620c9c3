// Adaptive sampling: error estimate, sample counts and time budget of the image.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "tests/support/effort.h"
#include "tests/support/scenes.h"
#include "tracer/compare.h"

namespace {

using namespace tracer;

/// With the layers of samples and error.
Scene adapting(Scene scene, const Adaptive& adaptive) {
  scene.accuracy.adaptive = adaptive;
  scene.output.layers = {Layer::samples, Layer::error};
  return scene;
}

Adaptive until(double target_error, std::uint32_t samples_min = 1, std::uint32_t samples_max = 4096) {
  return {.target_error = target_error, .time_budget_ms = {}, .samples_min = samples_min, .samples_max = samples_max};
}

/// Edges, a mirror, glass, a checker and a soft light: something to refine of every kind.
Scene still_life(std::uint32_t side) {
  Scene scene = scenes::empty(side, {{1, 2, 7}, {0, 0.6, 0}, {0, 1, 0}, 35});
  scene.background.color = {0.2, 0.3, 0.5};
  scene.ambient = {0.1, 0.1, 0.1};
  scene.lights = {{RectLight{{2, 5, 2}, {1, 0, 0}, {0, 0, 1}}}};
  scene.textures.push_back({CheckerTexture{{Color{0.9, 0.8, 0.7}, Color{0.2, 0.1, 0.1}}}, {1, 1}, {0, 0}, ""});
  Material floor = scenes::matte({1, 1, 1});
  floor.color = TextureId{0};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, floor);
  scenes::add(scene, Sphere{{-1, 0.7, 0}, 0.7}, scenes::mirror(0.7));
  scenes::add(scene, Sphere{{0.8, 0.6, 0.8}, 0.6}, scenes::glass());
  scenes::add(scene, Sphere{{1, 0.5, -1.5}, 0.5}, scenes::matte({0.9, 0.4, 0.2}));
  scene.accuracy.cutoff = 1e-3;
  return scene;
}

void expect_same(const Rendered& one, const Rendered& other) {
  EXPECT_EQ(one.image.rgb, other.image.rgb);
  EXPECT_EQ(one.image.layers.samples, other.image.layers.samples);
  EXPECT_EQ(one.image.layers.error, other.image.layers.error);
  EXPECT_EQ(one.statistics, other.statistics);
  EXPECT_EQ(one.error.estimate, other.error.estimate);
  EXPECT_EQ(one.error.approximation, other.error.approximation);
}

TEST(AdaptiveImage, IsBitIdenticalForAnyNumberOfThreads) {
  std::vector<Scene> scenes{adapting(still_life(40), until(2))};
  Scene approximate = scenes[0];
  approximate.accuracy.approximate.shadows = Approximations::Shadows::none;
  scenes.push_back(approximate);
  for (std::uint64_t seed = 0; seed < effort::cases(4); ++seed)
    scenes.push_back(adapting(scenes::random(seed, 40), until(2)));
  std::size_t refined = 0;
  for (const Scene& scene : scenes) {
    const Rendered one = scenes::render(scene, 1);
    for (const std::uint32_t threads : {2u, 7u}) expect_same(one, scenes::render(scene, threads));
    refined += one.statistics.samples_max > 1 ? 1 : 0;
  }
  EXPECT_GE(refined, 2u) << "no scene was refined";
}

TEST(AdaptiveImage, HasTheRequestedAndReportedNumberOfSamples) {
  for (const Adaptive& limits :
       {until(1), until(0.01, 1, 64), until(100, 4, 32), until(1, 16, 16), until(100, 64, 256)}) {
    const Rendered rendered = scenes::render(adapting(still_life(24), limits));
    const auto& samples = rendered.image.layers.samples;
    const auto [least, most] = std::minmax_element(samples.begin(), samples.end());
    SCOPED_TRACE(testing::Message() << limits.samples_min << ".." << limits.samples_max);
    EXPECT_GE(*least, limits.samples_min);
    EXPECT_LE(*most, limits.samples_max);
    EXPECT_EQ(*least, rendered.statistics.samples_min);
    EXPECT_EQ(*most, rendered.statistics.samples_max);
    const auto in_image = std::accumulate(samples.begin(), samples.end(), std::uint64_t{0});
    EXPECT_LE(in_image, rendered.statistics.samples - rendered.statistics.holdout_samples);
    EXPECT_EQ(rendered.statistics.samples, rendered.statistics.rays.camera);
  }
}

TEST(AdaptiveImage, ReachesItsTargetOrReportsThatItDoesNot) {
  for (const double target : {0.5, 2.0, 16.0}) {
    for (const std::uint32_t samples_max : {4u, 4096u}) {
      const ErrorEstimate error = scenes::render(adapting(still_life(32), until(target, 1, samples_max))).error;
      EXPECT_EQ(error.target, target);
      EXPECT_EQ(error.target_met, error.estimate <= target);
      if (samples_max == 4096) {
        EXPECT_TRUE(error.target_met) << error.estimate << " of " << target;
      }
      if (samples_max == 4 && target < 1) {
        EXPECT_FALSE(error.target_met) << "four samples cannot do that";
      }
    }
  }
}

double root_mean_square(const std::vector<float>& values) {
  double sum = 0;
  for (const float value : values) sum += static_cast<double>(value) * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

TEST(AdaptiveImage, IsNoWorseAndTakesNoFewerSamplesForASmallerTarget) {
  double estimate = std::numeric_limits<double>::infinity(), layer = estimate;
  std::uint64_t samples = 0;
  for (const double target : {16.0, 4.0, 1.0}) {
    const Rendered rendered = scenes::render(adapting(still_life(48), until(target)));
    EXPECT_LE(rendered.error.estimate, estimate) << target;
    EXPECT_LE(root_mean_square(rendered.image.layers.error), layer) << target;
    EXPECT_GE(rendered.statistics.samples, samples) << target;
    estimate = rendered.error.estimate;
    layer = root_mean_square(rendered.image.layers.error);
    samples = rendered.statistics.samples;
  }
}

TEST(AdaptiveImage, OfOneColorTakesOneSamplePerPixel) {
  Scene scene = scenes::empty(128, {{0, 5, 0}, {0, 0, 0}, {0, 0, 1}, 40});
  scene.lights = {scenes::directional_light({0, -1, 0.5})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.5, 0.5, 0.5}));
  const Rendered rendered = scenes::render(adapting(scene, until(1)));
  EXPECT_EQ(rendered.statistics.samples_max, 1u);
  EXPECT_EQ(rendered.statistics.samples - rendered.statistics.holdout_samples, 128u * 128);
  EXPECT_GT(rendered.error.looks, 500u) << "a claim rests on something";
  EXPECT_LT(rendered.error.estimate, 1e-3);
  scene.accuracy.adaptive.reset();
  EXPECT_EQ(rendered.image.rgb, scenes::render(scene).image.rgb);
}

// ---- time ----------------------------------------------------------------------------------------------------------

/// A clock that advances by a millisecond with each reading, and calls `then` at one of the readings.
struct FakeClock {
  std::atomic<int> readings{0};
  int moment = -1;
  std::function<void()> then{};
  RenderSettings settings(std::uint32_t threads = 1) {
    return {.elapsed_ms =
                [this] {
                  const int now = ++readings;
                  if (now == moment && then) then();
                  return static_cast<double>(now);
                },
            .threads = threads};
  }
};

/// A scene without black pixels.
Scene bright(std::uint32_t side) {
  Scene scene = still_life(side);
  scene.ambient = {0.3, 0.3, 0.3};
  scene.materials[1].emission = scene.materials[2].emission = Color{0.1, 0.1, 0.1};
  return scene;
}

Rendered within(double budget_ms, const Scene& scene = bright(64), int* readings = nullptr) {
  const Adaptive adaptive{.target_error = {}, .time_budget_ms = budget_ms};
  FakeClock clock;
  RenderControl control;
  auto rendered = render(*scenes::compiled(adapting(scene, adaptive)), clock.settings(), control);
  EXPECT_TRUE(rendered.has_value());
  if (readings != nullptr) *readings = clock.readings;
  return std::move(*rendered);
}

TEST(TimeBudget, GivesACompleteImageWheneverItEnds) {
  for (const double budget_ms : {1e-6, 1.0, 5.0, 20.0, 40.0, 60.0, 100.0, 150.0}) {
    const Rendered rendered = within(budget_ms);
    EXPECT_GT(*std::min_element(rendered.image.rgb.begin(), rendered.image.rgb.end()), 0) << budget_ms;
    EXPECT_TRUE(std::isfinite(rendered.error.estimate) && rendered.error.estimate > 0) << budget_ms;
    EXPECT_TRUE(rendered.error.target_met) << "no target, nothing missed";
  }
}

TEST(TimeBudget, OfAlmostNothingTracesAlmostNothing) {
  const Rendered rendered = within(1e-6);
  const std::uint64_t audited = rendered.statistics.holdout_samples;
  EXPECT_EQ(rendered.statistics.rays.camera - audited, 1u) << "something to show";
  EXPECT_GT(audited, 0u) << "a claim rests on something";
  EXPECT_LE(audited, 512u);
  EXPECT_EQ(rendered.statistics.samples_min, 0u);
}

TEST(TimeBudget, ThatSufficesSamplesEveryPixelOfAnyImageSize) {
  for (const auto& [width, height] : {std::pair{1u, 1u}, {33u, 1u}, {33u, 65u}, {2u, 95u}, {48u, 36u}}) {
    Scene scene = bright(64);
    scene.image = {width, height};
    const RenderStatistics statistics = within(400, scene).statistics;
    EXPECT_GE(statistics.samples_min, 1u) << width << " x " << height;
    EXPECT_GT(statistics.samples_max, 1u) << width << " x " << height;
  }
}

TEST(TimeBudget, OfACoarseGridReportsAValidErrorEstimate) {
  const Scene scene = bright(128);
  Scene converged = scene;
  converged.accuracy.samples = 16;
  const DisplayImage truth = to_display(scenes::render(converged).image);
  for (const double budget_ms : {1e-6, 10.0, 30.0, 60.0}) {
    const Rendered rendered = within(budget_ms, scene);
    ASSERT_EQ(rendered.statistics.samples_min, 0u) << budget_ms;
    EXPECT_LE(compare(truth, to_display(rendered.image))->rmse, rendered.error.estimate) << budget_ms;
  }
}

TEST(TimeBudget, ThatEndsARoundLeavesThePilotsOfPixelsWithoutSamples) {
  double earlier = 255;  // levels
  for (double budget_ms = 100; budget_ms <= 250; budget_ms += 10) {
    const Rendered rendered = within(budget_ms);
    EXPECT_GE(std::ranges::min(rendered.image.layers.samples), 1u) << budget_ms;
    EXPECT_LT(rendered.error.estimate, 1.5 * earlier) << budget_ms;
    earlier = std::min(earlier, rendered.error.estimate);
  }
}

TEST(TimeBudget, EndsTheMeasurementOfApproximationsToo) {
  Scene scene = bright(32);
  scene.accuracy.approximate.shadows = Approximations::Shadows::none;
  const Rendered rendered = within(100, scene);
  EXPECT_GT(rendered.error.looks, 0u);
  EXPECT_LT(rendered.error.looks, 2048u) << "as many as without a budget";
}

TEST(TimeBudget, IsCheckedBeforeEveryTileAndEndsTheRender) {
  constexpr double budget_ms = 100;
  int readings = 0, readings_at_least = 0;
  const Rendered rendered = within(budget_ms, bright(64), &readings);
  EXPECT_GE(readings, 0.8 * budget_ms) << "it is used, except for the reserve at the end";
  // After the end, the clock is read once for every omitted tile, and a few times for the estimate.
  within(1e-6, bright(64), &readings_at_least);
  EXPECT_LE(readings, budget_ms + readings_at_least);
  EXPECT_LT(rendered.statistics.samples_max, 4096u);
}

TEST(TimeBudget, GivesMoreSamplesAndLessErrorIfLarger) {
  std::uint64_t samples = 0;
  double error = std::numeric_limits<double>::infinity();
  for (const double budget_ms : {20.0, 80.0, 200.0, 500.0}) {
    const Rendered rendered = within(budget_ms);
    EXPECT_GT(rendered.statistics.samples, samples) << budget_ms;
    EXPECT_LT(rendered.error.estimate, error) << budget_ms;
    samples = rendered.statistics.samples;
    error = rendered.error.estimate;
  }
}

TEST(TimeBudget, HasNoEffectWithoutAClockOrIfTheTargetIsReachedSooner) {
  const Scene scene = adapting(still_life(48), until(4));
  Scene hurried = scene;
  hurried.accuracy.adaptive->time_budget_ms = 1e-6;
  expect_same(scenes::render(hurried), scenes::render(scene));
}

TEST(Cancellation, OfAnAdaptiveRenderStopsItAtAnyMomentWithoutAnImage) {
  const Adaptive adaptive{.target_error = {}, .time_budget_ms = 1e9, .samples_max = 64};
  const auto scene = scenes::compiled(adapting(still_life(64), adaptive));
  for (const int moment : {1, 2, 3, 20, 50, 70, 90, 110}) {
    RenderControl control;
    FakeClock clock;
    clock.moment = moment;
    clock.then = [&] { control.cancel(); };
    const auto image = render(*scene, clock.settings(2), control);
    ASSERT_GE(clock.readings, moment);
    ASSERT_FALSE(image.has_value()) << moment;
    EXPECT_EQ(image.error().code, Failure::Code::cancelled);
    EXPECT_LT(clock.readings, moment + 20) << "no more than a tile of each thread";
  }
}

// ---- approximations ------------------------------------------------------------------------------------------------

TEST(ApproximationError, IsMeasuredAndReportedSeparately) {
  Scene exact = still_life(64), shadowless = exact;
  shadowless.accuracy.approximate.shadows = Approximations::Shadows::none;
  const auto converged = [](Scene scene) {
    scene.accuracy.samples = 64;
    return to_display(scenes::render(scene, 2).image);
  };
  const double apart = compare(converged(exact), converged(shadowless))->rmse;
  ASSERT_GT(apart, 4) << "there was nothing to leave out";
  for (const double target : {1.0, 4.0}) {
    const ErrorEstimate error = scenes::render(adapting(shadowless, until(target))).error;
    EXPECT_GE(error.approximation, apart);
    EXPECT_LT(error.approximation, 2 * apart);
    EXPECT_GE(error.estimate, error.approximation);
    EXPECT_FALSE(error.target_met);
  }
}

TEST(ApproximationError, IsZeroWithoutApproximations) {
  EXPECT_EQ(scenes::render(adapting(still_life(48), until(4))).error.approximation, 0);
  Scene fixed = still_life(48);
  for (Texture& texture : fixed.textures) texture.filter = Texture::Filter::nearest;
  EXPECT_EQ(scenes::render(fixed).error.approximation, 0);
}

}  // namespace
