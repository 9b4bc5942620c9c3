// The proof of an image's error: true, the same however it is traced, and paid for only where it is requested.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/compare.h"
#include "tracer/parts.h"

namespace {

using namespace tracer;

/// Surfaces of one colour below a light, and spheres that a sample of a pixel may miss.
Scene specks(std::uint64_t seed, std::uint32_t side) {
  oracle::Random random(seed);
  Scene scene = scenes::empty(side, {{0, 6, 8}, {0, 0, 0}, {0, 1, 0}, 40});
  scene.background.color = {0.3, 0.3, 0.4};
  scene.lights = {scenes::point_light({3, 8, 4}, {0.8, 0.8, 0.8})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.4, 0.4, 0.4}));
  const MaterialId bright = scenes::add(scene, scenes::glowing({1, 1, 1}));
  for (std::uint32_t i = 0, count = 2 + random.below(40); i < count; ++i)
    scenes::add(scene, Sphere{{random.in(-2, 2), random.in(0, 1), random.in(-2, 2)}, random.spread(0.003, 0.1)},
                bright);
  return scene;
}

Scene adaptive(Scene scene, double target_error) {
  scene.accuracy.adaptive.emplace().target_error = target_error;
  return scene;
}

Scene with_proof(Scene scene) {
  scene.accuracy.proof = true;
  return scene;
}

double distance(const Image& one, const Image& other, const Output& output) {
  return compare(to_display(one, output), to_display(other, output))->rmse;
}

/// The bound holds with 95 % in each trial, and mostly with much more.
TEST(Proof, IsAboveTheTrueError) {
  constexpr std::uint32_t side = 40, reference_samples = 400;
  std::uint64_t wrong = 0, finite = 0;
  double largest_truth = 0;
  const std::uint64_t trials = effort::cases(24);
  for (std::uint64_t seed = 0; seed < trials; ++seed) {
    Scene scene = seed % 2 == 0 ? specks(seed, side) : scenes::random(seed, side);
    Scene whole = scene;  // without the limits of the rays
    scenes::end_by_chance(whole);
    whole.accuracy.samples = reference_samples;
    const Image truth = scenes::render(whole, 2).image;
    scene.materials = whole.materials;
    scene.accuracy.samples = seed % 3 == 0 ? 1 : 4;
    const Rendered rendered = scenes::render(with_proof(seed % 5 == 4 ? adaptive(scene, 4) : scene), 2);
    // The distance of the reference from its limit is below a tenth of an error that matters here.
    const double error = distance(rendered.image, truth, scene.output);
    if (!std::isfinite(rendered.error.proven)) continue;
    ++finite;
    largest_truth = std::max(largest_truth, error);
    wrong += rendered.error.proven < 0.9 * error ? 1 : 0;
  }
  EXPECT_GT(finite, trials / 2);
  EXPECT_GT(largest_truth, 2);
  EXPECT_LE(wrong, 1 + trials / 10);
}

/// A sphere that no pilot finds, of an image whose other pixels are certain.
TEST(Proof, IncludesWhatTheImageMissed) {
  Scene scene = scenes::empty(64, {{0, 0, 8}, {0, 0, 0}, {0, 1, 0}, 40});
  scene.background.color = {0.05, 0.05, 0.05};
  scenes::add(scene, Sphere{{0.075, 0.07, 0}, 0.02}, scenes::glowing({1, 1, 1}));
  const Rendered rendered = scenes::render(with_proof(scene));
  Scene exact = scene;
  exact.accuracy.samples = 1024;
  const double truth = distance(rendered.image, scenes::render(exact).image, scene.output);
  EXPECT_GT(truth, 0.1);
  EXPECT_GE(rendered.error.proven, truth);
  EXPECT_LT(rendered.error.proven, 8);  // 255 sqrt(4 / 64^2), if the sphere has four pixels
}

TEST(Proof, IsExactWhereNothingIsInDoubt) {
  Scene scene = scenes::empty(32, {{0, 0, 8}, {0, 0, 0}, {0, 1, 0}, 40});
  scene.background.color = {0.25, 0.5, 0.75};
  const Rendered rendered = scenes::render(with_proof(scene));
  EXPECT_EQ(rendered.error.proven, 0);
  EXPECT_EQ(rendered.statistics.holdout_samples, 0u);
}

/// Surfaces of one colour and the background are known, which saves most looks; what a mirror shows is not known.
TEST(Proof, TakesFewLooksWhereSurfacesArePlain) {
  Scene scene = scenes::empty(128, {{0, 3, 6}, {0, 0, 0}, {0, 1, 0}, 40});
  scene.background.color = {0.2, 0.3, 0.5};
  scene.lights = {scenes::point_light({2, 6, 2}, {0.7, 0.7, 0.7})};
  scenes::add(scene, Sphere{{0, 0.5, 0}, 1}, scenes::matte({0.5, 0.3, 0.2}));
  scene.accuracy.samples = 256;
  scene.accuracy.target_error = 1.5;
  const Rendered plain = scenes::render(with_proof(scene));
  scene.materials[0].reflection = 0.5;
  const Rendered mirror = scenes::render(with_proof(scene));
  EXPECT_LE(plain.error.proven, 1.5);
  EXPECT_LE(mirror.error.proven, 1.5);
  EXPECT_LT(2 * plain.error.looks, mirror.error.looks);
}

TEST(Proof, ChangesNothingButItsOwnFigures) {
  for (const Scene& scene : {specks(1, 48), adaptive(specks(2, 48), 2), adaptive(scenes::random(6, 48), 3)}) {
    const Rendered without = scenes::render(scene), with = scenes::render(with_proof(scene), 3);
    EXPECT_EQ(without.image.rgb, with.image.rgb);
    EXPECT_EQ(without.error.estimate, with.error.estimate);
    EXPECT_TRUE(std::isinf(without.error.proven));
    EXPECT_GT(with.statistics.holdout_samples, without.statistics.holdout_samples);
    EXPECT_EQ(without.statistics.samples - without.statistics.holdout_samples,
              with.statistics.samples - with.statistics.holdout_samples);
    const Rendered again = scenes::render(with_proof(scene), 1);
    EXPECT_EQ(with.error.proven, again.error.proven);
    EXPECT_EQ(with.error.looks, again.error.looks);
    EXPECT_EQ(with.statistics, again.statistics);
  }
}

TEST(Proof, CostsAtMostAsManySamplesAsTheImage) {
  Scene scene = specks(4, 96);
  scene.accuracy.samples = 9;
  const RenderStatistics statistics = scenes::render(with_proof(scene)).statistics;
  EXPECT_LE(statistics.holdout_samples, 9u * 96 * 96);
  EXPECT_GT(statistics.holdout_samples, 9u * 96 * 96 / 2);
}

TEST(Proof, EndsWhereTheTargetIsProven) {
  Scene scene = specks(5, 96);
  scene.accuracy.samples = 64;
  scene.accuracy.target_error = 12;
  const Rendered rendered = scenes::render(with_proof(scene));
  EXPECT_LE(rendered.error.proven, 12);
  EXPECT_LT(rendered.statistics.holdout_samples, 64u * 96 * 96 / 4);
}

/// Exact samples: an image without shadows is wrong where these are.
TEST(Proof, IncludesApproximations) {
  Scene scene = scenes::empty(64, {{0, 10, 0}, {0, 0, 0}, {0, 0, -1}, 45});
  scene.lights = {scenes::point_light({3, 8, 1})};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.8, 0.8, 0.8}));
  scenes::add(scene, Sphere{{0, 1, 0}, 0.8}, scenes::matte({0.6, 0.2, 0.1}));
  scene.accuracy.samples = 16;
  const Image exact = scenes::render(scene).image;
  scene.accuracy.approximate.shadows = Approximations::Shadows::none;
  const Rendered rendered = scenes::render(with_proof(scene));
  const double truth = distance(rendered.image, exact, scene.output);
  EXPECT_GT(truth, 5);
  EXPECT_GE(rendered.error.proven, truth);
}

TEST(Proof, IsNoneOfAnImageThatItsBrightestPixelDivides) {
  Scene scene = specks(6, 32);
  scene.output.overflow = Output::Overflow::scale;
  const Rendered rendered = scenes::render(with_proof(scene));
  EXPECT_TRUE(std::isinf(rendered.error.proven));
}

/// A clock that advances by a millisecond each time it is read.
TEST(Proof, TakesAShareOfATimeBudget) {
  Scene scene = with_proof(specks(7, 64));
  scene.accuracy.adaptive.emplace().time_budget_ms = 4000;
  RenderControl control;
  std::atomic<int> now = 0;
  const RenderSettings settings{.elapsed_ms = [&] { return static_cast<double>(now++); }, .threads = 1};
  const auto rendered = render(*scenes::compiled(scene), settings, control);
  ASSERT_TRUE(rendered);
  EXPECT_TRUE(std::isfinite(rendered->error.proven));
  EXPECT_GE(now, 1000);
  EXPECT_LT(now, 4100);
}

TEST(Proof, EndsWhenTheRenderIsCancelled) {
  /// Cancels in the second round of samples, which is that of the first looks.
  struct Cancelling final : PartExchange {
    explicit Cancelling(RenderControl& of_render) : control(of_render) {}
    bool divides(std::uint64_t) override {
      if (++rounds == 2) control.cancel();
      return false;
    }
    void begin(std::span<const Part>) override {}
    std::optional<std::size_t> take() override { return std::nullopt; }
    void put(std::size_t, std::string_view) override {}
    std::vector<PartResult> wait() override { return {}; }
    RenderControl& control;
    int rounds = 0;
  };
  const Scene scene = with_proof(specks(8, 64));
  RenderControl control;
  Cancelling exchange(control);
  const auto rendered = render(*scenes::compiled(scene), {.threads = 1, .exchange = &exchange}, control);
  ASSERT_FALSE(rendered);
  EXPECT_EQ(rendered.error().code, Failure::Code::cancelled);
  EXPECT_EQ(exchange.rounds, 2);
}

}  // namespace
