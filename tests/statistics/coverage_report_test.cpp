// Tests of the statistics: binomial test, code values, reference image and coverage report.
#include "tests/statistics/coverage_report.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/reference_tracer.h"
#include "tracer/src/display/srgb.h"

namespace {

using namespace statistics;
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

TEST(Coverage, IsRejectedAtASignificanceOfOneThousandth) {
  // With 25 estimates at 95 %, 6 misses have probability 0.0012, 7 have 0.0002.
  EXPECT_FALSE((Coverage{25, 6}.rejected(0.95)));
  EXPECT_TRUE((Coverage{25, 7}.rejected(0.95)));
  EXPECT_FALSE((Coverage{}.rejected(0.95)));
}

TEST(DisplayTransform, EqualsTheCurveOfTheEncoder) {
  const Output plain;
  for (const double linear : {0.0, 1e-4, 0.0031308, 0.02, 0.5, 1.0})
    EXPECT_NEAR(code_value_of(linear, 1, plain), 255 * srgb_from_linear(linear), 1e-4);
  EXPECT_DOUBLE_EQ(code_value_of(7, 1, plain), 255);
}

TEST(DisplayTransform, AppliesExposureAndOverflowBeforeTheCurve) {
  Output output;
  output.exposure = 1;
  EXPECT_EQ(code_values_of({0.1}, output), code_values_of({0.2}, Output{}));
  output = {.overflow = Output::Overflow::scale};
  EXPECT_EQ(code_values_of({0.5, 4}, output), code_values_of({0.125, 1}, Output{}));
  EXPECT_EQ(code_values_of({0.5, 0.25}, output), code_values_of({0.5, 0.25}, Output{}));
  output = {.overflow = Output::Overflow::reinhard};
  EXPECT_EQ(code_values_of({3}, output), code_values_of({0.75}, Output{}));
}

/// Compares some pixels of the reference with the mean of jittered grids of samples of a tracer that shares no code
/// with it. The spread of the grids gives the standard error of the mean.
void expect_independent_tracer_agrees(const Case& scene) {
  SCOPED_TRACE(scene.name);
  constexpr int side = 6, grids = 10;
  const ReferenceImage reference = compute_reference(scene, {.samples = 256, .images_min = 8, .images_max = 8});
  const Scene exact = exact_scene(scene.scene, 1, 0);
  const oracle::ReferenceTracer second(exact);
  oracle::Random draw(5);
  RenderStatistics counted;
  double distance = 0, expected = 0;  // sums over all values: squared differences, and their variances
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
      const double level = code_value_of(mean, 1, {});
      const double error = code_value_of(mean + deviation, 1, {}) - level;
      const double allowed = reference.variance[i] + error * error;
      // A float's last place is worth up to 0.0001 code values. Of 36 values none is 7 of its standard errors off,
      // though these are known from ten grids only.
      EXPECT_LE(std::abs(level - reference.code_values[i]), 7 * std::sqrt(allowed) + 1e-3) << x << " " << y << " " << c;
      distance += (level - reference.code_values[i]) * (level - reference.code_values[i]);
      expected += allowed;
    }
  }
  // One edge pixel may contribute most of either sum.
  EXPECT_LE(distance, 3 * expected + 1e-3);
}

TEST(ReferenceImage, EqualsTheLimitOfAnIndependentTracer) {
  for (const char* name : {"ball", "mirror_balls", "glass_ball", "checker_filtered", "prism"})
    expect_independent_tracer_agrees(*find(name));
}

TEST(ReferenceImage, EstimatesItsStandardError) {
  // Four images against the mean of sixty others. (The first four of the latter are the former, a fifteenth of it.)
  for (const char* name : {"star", "wide_penumbra"}) {
    const ReferenceImage coarse = compute_reference(*find(name), {.samples = 16, .images_min = 4, .images_max = 4});
    const ReferenceImage fine = compute_reference(*find(name), {.samples = 16, .images_min = 60, .images_max = 60});
    double squares = 0;
    for (std::size_t i = 0; i < fine.code_values.size(); ++i)
      squares +=
          std::pow(coarse.code_values[i] - fine.code_values[i], 2) / static_cast<double>(fine.code_values.size());
    const double expected = std::sqrt(14.0 / 15) * coarse.error();
    EXPECT_NEAR(std::sqrt(squares) / expected, 1, 0.15) << name << " " << expected;
  }
}

TEST(ReferenceImage, IsReadFromItsFileAndContinued) {
  const std::filesystem::path directory =
      testing::TempDir() + "reference-" + std::to_string(testing::UnitTest::GetInstance()->random_seed());
  std::filesystem::remove_all(directory);
  const Case& scene = *find("ball");
  ReferenceSettings few{.samples = 4, .images_min = 2, .images_max = 2};
  const ReferenceImage first = compute_reference(scene, few, directory);
  EXPECT_EQ(compute_reference(scene, few, directory).linear, first.linear);
  few.images_min = few.images_max = 3;
  const ReferenceImage continued = compute_reference(scene, few, directory);
  EXPECT_EQ(continued.images, 3u);
  EXPECT_EQ(continued.linear, compute_reference(scene, few).linear);
  EXPECT_EQ(continued.variance, compute_reference(scene, few).variance);
  std::filesystem::remove_all(directory);
}

/// Images with fixed samples and an error estimate of `estimated` times their mean true error.
SceneTrials fixed_trials(const Case& scene, double estimated, bool biased) {
  const GroundTruth ground_truth{compute_reference(scene, {.samples = 256, .images_min = 8, .images_max = 8}),
                                 classify_pixels(scene)};
  SceneTrials scene_trials{scene.name, {}, {}};
  for (const std::uint32_t samples : {4u, 16u}) {
    std::vector<Rendered> images;
    double squares = 0;
    constexpr std::uint64_t seeds = 6;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      images.push_back(scenes::render(exact_scene(scene.scene, samples, seed)));
      squares += std::pow(evaluate(scene, ground_truth, images.back(), 1, seed).true_error, 2);
    }
    const double true_error = std::sqrt(squares / seeds);
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      Rendered& image = images[seed - 1];
      if (biased)
        inject_bias(image.image, scenes::render(exact_scene(without_light(scene).scene, samples, seed)).image, seed);
      image.error.estimate = estimated * true_error;
      image.error.target = samples == 4 ? 100 : 50;  // met by every estimate
      image.image.layers.error.assign(ground_truth.pixel_classes.size(), 255);
      scene_trials.trials.push_back(evaluate(scene, ground_truth, image, *image.error.target, seed));
    }
  }
  return scene_trials;
}

TEST(CoverageReport, AcceptsCalibratedEstimates) {
  const CoverageReport report = report_coverage({fixed_trials(*find("ball"), 1.2, false)});
  EXPECT_TRUE(report.failures.empty()) << report.failures[0];
  EXPECT_EQ(report.trials, 12u);
}

TEST(CoverageReport, RejectsEstimatesOfHalfTheError) {
  const CoverageReport report = report_coverage({fixed_trials(*find("ball"), 0.5, false)});
  EXPECT_TRUE(report.images.rejected(0.95));
  EXPECT_FALSE(report.failures.empty());
}

TEST(CoverageReport, RejectsEstimatesOfTenTimesTheError) {
  const CoverageReport report = report_coverage({fixed_trials(*find("ball"), 10, false)});
  EXPECT_FALSE(report.images.rejected(0.95));
  EXPECT_EQ(report.calibrated, 0u);
  EXPECT_FALSE(report.failures.empty());
}

TEST(CoverageReport, RejectsImagesWithBiasInOnePixelOfAHundred) {
  const CoverageReport report = report_coverage({fixed_trials(*find("ball"), 1.2, true)});
  EXPECT_TRUE(report.images.rejected(0.95));
}

TEST(CoverageReport, FindsAnErrorThatIncreasesAsTheTargetDecreases) {
  SceneTrials scene_trials = fixed_trials(*find("ball"), 1.2, false);
  EXPECT_TRUE(find_increases(summarize(scene_trials)).empty());
  std::rotate(scene_trials.trials.begin(), scene_trials.trials.begin() + 6, scene_trials.trials.end());
  EXPECT_EQ(find_increases(summarize(scene_trials)).size(), 1u);
}

TEST(CoverageReport, RejectsAPixelClassThatIsWorseThanItsEstimate) {
  SceneTrials scene_trials = fixed_trials(*find("wide_penumbra"), 1.2, false);
  const auto penumbra = static_cast<std::size_t>(PixelClass::penumbra);
  for (Trial& trial : scene_trials.trials)
    trial.pixel_classes[penumbra].estimated = trial.pixel_classes[penumbra].true_error / 2;
  const CoverageReport report = report_coverage({scene_trials});
  EXPECT_TRUE(report.pixel_classes[penumbra].rejected(0.95));
  EXPECT_FALSE(report.pixel_classes[static_cast<std::size_t>(PixelClass::edge)].rejected(0.95));
}

}  // namespace
