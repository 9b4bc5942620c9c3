// What judges the tracer is right itself: the statistics, the levels, the reference and the verdict.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/honesty/verdict.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/reference_tracer.h"
#include "tracer/src/display/srgb.h"

namespace {

using namespace honesty;
using namespace tracer;

/// By Pascal's rule: the probability of exactly k failures in n tries, one try after the other.
std::vector<long double> distribution(std::uint64_t trials, long double p) {
  std::vector<long double> chance{1};
  for (std::uint64_t n = 0; n < trials; ++n) {
    chance.push_back(0);
    for (std::size_t k = chance.size() - 1; k > 0; --k) chance[k] = chance[k] * (1 - p) + chance[k - 1] * p;
    chance[0] *= 1 - p;
  }
  return chance;
}

TEST(BinomialTail, EqualsTheSumOverPascalsRule) {
  for (const std::uint64_t trials : {1u, 5u, 25u, 1000u})
    for (const long double p : {0.001L, 0.05L, 0.5L, 0.9L}) {
      const auto chance = distribution(trials, p);
      long double tail = 0;
      for (std::uint64_t k = trials + 1; k-- > 0;) {
        tail += chance[k];
        if (tail < 1e-300L) continue;  // Pascal's rule has left the normal numbers behind
        EXPECT_NEAR(static_cast<double>(binomial_tail(trials, k, p) / tail), 1, 1e-12) << trials << " " << k;
      }
    }
}

TEST(Coverage, IsRejectedFromTheCountThatIsRarerThanAThousandth) {
  // Of 25 claims at 95 %: 6 broken ones come with probability 0.0012, 7 with 0.0002.
  EXPECT_FALSE((Coverage{25, 6}.rejected(0.95)));
  EXPECT_TRUE((Coverage{25, 7}.rejected(0.95)));
  EXPECT_FALSE((Coverage{}.rejected(0.95)));
}

TEST(DisplayTransform, AreTheCurveThatTheTracerEncodesWith) {
  const Output plain;
  for (const double linear : {0.0, 1e-4, 0.0031308, 0.02, 0.5, 1.0})
    EXPECT_NEAR(level_of(linear, 1, plain), 255 * srgb_from_linear(linear), 1e-4);
  EXPECT_DOUBLE_EQ(level_of(7, 1, plain), 255);
}

TEST(DisplayTransform, TakeExposureAndOverflowBeforeTheCurve) {
  Output output;
  output.exposure = 1;
  EXPECT_EQ(levels_of({0.1}, output), levels_of({0.2}, Output{}));
  output = {.overflow = Output::Overflow::scale};
  EXPECT_EQ(levels_of({0.5, 4}, output), levels_of({0.125, 1}, Output{}));
  EXPECT_EQ(levels_of({0.5, 0.25}, output), levels_of({0.5, 0.25}, Output{}));
  output = {.overflow = Output::Overflow::reinhard};
  EXPECT_EQ(levels_of({3}, output), levels_of({0.75}, Output{}));
}

/// The reference against a tracer that shares no code with it, on some pixels: the mean of jittered grids of samples,
/// whose own error is told by how the grids differ.
void expect_second_tracer_agrees(const Case& scene) {
  SCOPED_TRACE(scene.name);
  constexpr int side = 6, grids = 10;
  const Reference reference = reference_of(scene, {.samples = 256, .images_min = 8, .images_max = 8});
  const Scene exact = exact_scene(scene.scene, 1, 0);
  const oracle::ReferenceTracer second(exact);
  oracle::Random draw(5);
  RenderStatistics counted;
  double distance = 0, expected = 0;  // sums of squares over all values: of the differences, and of what may be
  for (std::uint64_t tried = 0; tried < effort::cases(12); ++tried) {
    const std::uint32_t x = draw.below(exact.image.width), y = draw.below(exact.image.height);
    oracle::Real sum[3]{}, squares[3]{};
    for (int grid = 0; grid < grids; ++grid) {
      oracle::Real mean[3]{};
      for (int cell = 0; cell < side * side; ++cell) {
        const int column = cell % side, row = cell / side;
        const oracle::Light3 light =
            second.sample(x + (column + draw.in(0, 1)) / side, y + (row + draw.in(0, 1)) / side, counted).radiance;
        mean[0] += light.r / (side * side), mean[1] += light.g / (side * side), mean[2] += light.b / (side * side);
      }
      for (int c = 0; c < 3; ++c) sum[c] += mean[c], squares[c] += mean[c] * mean[c];
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t i = 3 * (static_cast<std::size_t>(y) * exact.image.width + x) + c;
      const auto mean = static_cast<double>(sum[c] / grids);
      const double deviation =
          std::sqrt(std::max(0.0, static_cast<double>(squares[c] / grids) - mean * mean) / (grids - 1));
      const double level = level_of(mean, 1, {});
      const double error = level_of(mean + deviation, 1, {}) - level;
      const double allowed = reference.variance[i] + error * error;
      // A float's last place is worth up to 0.0001 levels. Of 36 values none is 7 of its standard errors off, though
      // these are known from ten grids only.
      EXPECT_LE(std::abs(level - reference.levels[i]), 7 * std::sqrt(allowed) + 1e-3) << x << " " << y << " " << c;
      distance += (level - reference.levels[i]) * (level - reference.levels[i]);
      expected += allowed;
    }
  }
  // One edge pixel may bring most of either sum: so much for chance.
  EXPECT_LE(distance, 3 * expected + 1e-3);
}

TEST(Reference, IsWhatASecondTracerConvergesTo) {
  for (const char* name : {"ball", "mirror_balls", "glass_ball", "checker_filtered", "prism"})
    expect_second_tracer_agrees(*find(name));
}

TEST(Reference, KnowsHowFarItIsFromConverged) {
  // Four images against the mean of sixty others. (The first four of the latter are the former: they are a fifteenth
  // of it.)
  for (const char* name : {"star", "wide_penumbra"}) {
    const Reference coarse = reference_of(*find(name), {.samples = 16, .images_min = 4, .images_max = 4});
    const Reference fine = reference_of(*find(name), {.samples = 16, .images_min = 60, .images_max = 60});
    double squares = 0;
    for (std::size_t i = 0; i < fine.levels.size(); ++i)
      squares += std::pow(coarse.levels[i] - fine.levels[i], 2) / static_cast<double>(fine.levels.size());
    const double expected = std::sqrt(14.0 / 15) * coarse.error();
    EXPECT_NEAR(std::sqrt(squares) / expected, 1, 0.15) << name << " " << expected;
  }
}

TEST(Reference, IsTakenUpFromItsFileAndContinued) {
  const std::filesystem::path directory =
      testing::TempDir() + "honesty-" + std::to_string(testing::UnitTest::GetInstance()->random_seed());
  std::filesystem::remove_all(directory);
  const Case& scene = *find("ball");
  ReferenceEffort few{.samples = 4, .images_min = 2, .images_max = 2};
  const Reference first = reference_of(scene, few, directory);
  EXPECT_EQ(reference_of(scene, few, directory).linear, first.linear);
  few.images_min = few.images_max = 3;
  const Reference continued = reference_of(scene, few, directory);
  EXPECT_EQ(continued.images, 3u);
  EXPECT_EQ(continued.linear, reference_of(scene, few).linear);
  EXPECT_EQ(continued.variance, reference_of(scene, few).variance);
  std::filesystem::remove_all(directory);
}

/// Images of fixed samples, whose error is claimed to be `claimed` times what it is in the mean over many.
Outcome fixed_outcome(const Case& scene, double claimed, bool biased) {
  const Standard standard{reference_of(scene, {.samples = 256, .images_min = 8, .images_max = 8}), strata_of(scene)};
  Outcome outcome{scene.name, {}, {}};
  for (const std::uint32_t samples : {4u, 16u}) {
    std::vector<Rendered> images;
    double squares = 0;
    constexpr std::uint64_t seeds = 6;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      images.push_back(scenes::render(exact_scene(scene.scene, samples, seed)));
      squares += std::pow(judged(scene, standard, images.back(), 1, seed).truth, 2);
    }
    const double truth = std::sqrt(squares / seeds);
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      Rendered& image = images[seed - 1];
      if (biased)
        seed_bias(image.image, scenes::render(exact_scene(without_light(scene).scene, samples, seed)).image, seed);
      image.error.estimate = claimed * truth;
      image.error.target = samples == 4 ? 100 : 50;  // generous: what is claimed is what matters here
      image.image.layers.error.assign(standard.strata.size(), 255);
      outcome.trials.push_back(judged(scene, standard, image, *image.error.target, seed));
    }
  }
  return outcome;
}

TEST(Verdict, AcceptsClaimsThatHold) {
  const Verdict verdict = verdict_on({fixed_outcome(*find("ball"), 1.2, false)});
  EXPECT_TRUE(verdict.broken.empty()) << verdict.broken[0];
  EXPECT_EQ(verdict.trials, 12u);
}

TEST(Verdict, RejectsClaimsOfHalfTheError) {
  const Verdict verdict = verdict_on({fixed_outcome(*find("ball"), 0.5, false)});
  EXPECT_TRUE(verdict.images.rejected(0.95));
  EXPECT_FALSE(verdict.broken.empty());
}

TEST(Verdict, RejectsClaimsOfTenTimesTheError) {
  const Verdict verdict = verdict_on({fixed_outcome(*find("ball"), 10, false)});
  EXPECT_FALSE(verdict.images.rejected(0.95));
  EXPECT_EQ(verdict.close, 0u);
  EXPECT_FALSE(verdict.broken.empty());
}

TEST(Verdict, RejectsAnImageInWhichOnePixelOfAHundredLacksALight) {
  const Verdict verdict = verdict_on({fixed_outcome(*find("ball"), 1.2, true)});
  EXPECT_TRUE(verdict.images.rejected(0.95));
}

TEST(Verdict, FindsAnErrorThatGrowsWhenLessIsAskedFor) {
  Outcome outcome = fixed_outcome(*find("ball"), 1.2, false);
  EXPECT_TRUE(growths(rows_of(outcome)).empty());
  std::rotate(outcome.trials.begin(), outcome.trials.begin() + 6, outcome.trials.end());
  EXPECT_EQ(growths(rows_of(outcome)).size(), 1u);
}

TEST(Verdict, RejectsAStratumThatIsWorseThanItsPixelsAreSaidToBe) {
  Outcome outcome = fixed_outcome(*find("wide_penumbra"), 1.2, false);
  const auto penumbra = static_cast<std::size_t>(Stratum::penumbra);
  for (Trial& trial : outcome.trials) trial.strata[penumbra].claimed = trial.strata[penumbra].truth / 2;
  const Verdict verdict = verdict_on({outcome});
  EXPECT_TRUE(verdict.strata[penumbra].rejected(0.95));
  EXPECT_FALSE(verdict.strata[static_cast<std::size_t>(Stratum::edge)].rejected(0.95));
}

}  // namespace
