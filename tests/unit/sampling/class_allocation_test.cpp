// The allocation of samples to classes agrees with its closed form, and the error of classes is estimated without bias.
#include "tracer/src/sampling/class_allocation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace tracer {
namespace {

constexpr double no_limit = std::numeric_limits<double>::infinity();
constexpr std::size_t first = 2 * contrast_bins + 3, second = 3 * contrast_bins + 9;

/// Two classes of mixed pixels whose variances are known from many observations.
struct TwoClasses {
  TwoClasses(double variance_0, double variance_1, double rays_0, double rays_1) {
    counts[first] = {.pixels = 1000, .curvature = 0, .rays = 1000 * rays_0};
    counts[second] = {.pixels = 500, .curvature = 0, .rays = 500 * rays_1};
    found[first] = {.pixels = 1e9, .error = 1e9 * variance_0, .own = 1e9};
    found[second] = {.pixels = 1e9, .error = 1e9 * variance_1, .own = 1e9};
    for (std::size_t c = 0; c < class_count; ++c) left[c] = counts[c].pixels;
    kept[first] = variance_0 / 2;
    kept[second] = variance_1 / 2;
  }
  ByClass<ClassCount> counts{};
  ByClass<ClassStatistics> found{};
  ByClass<double> left{}, kept{};
};

/// Minimizing sum m v n^-p + lambda m c n gives n = k (v / c)^(1 / (1 + p)), and the error fixes k.
TEST(ClassAllocation, AgreesWithTheClosedForm) {
  for (const bool stratified : {true, false}) {
    const double p = stratified ? 1.5 : 1;
    const TwoClasses classes(5000, 160'000, 2, 9);
    const double goal = 1000;
    const auto samples =
        ClassAllocation(classes.counts, {stratified})
            .solve({.squared_error = goal, .rays = no_limit, .kept = classes.kept}, classes.left, classes.found);
    const double w0 = std::pow(5000 / 2.0, 1 / (1 + p)), w1 = std::pow(160'000 / 9.0, 1 / (1 + p));
    const double k = std::pow((1000 * 5000 * std::pow(w0, -p) + 500 * 160'000 * std::pow(w1, -p)) / goal, 1 / p);
    EXPECT_NEAR(samples[first], std::min(k * w0, 4096.0), 1.01 + 2e-3 * k * w0);
    EXPECT_NEAR(samples[second], std::min(k * w1, 4096.0), 1.01 + 2e-3 * k * w1);
  }
}

TEST(ClassAllocation, SpendsAtMostTheRays) {
  const TwoClasses classes(5000, 160'000, 2, 9);
  const double rays = 100'000;
  const auto samples =
      ClassAllocation(classes.counts, {})
          .solve({.squared_error = 0, .rays = rays, .kept = classes.kept}, classes.left, classes.found);
  const double spent = 1000.0 * 2 * samples[first] + 500.0 * 9 * samples[second];
  EXPECT_LE(spent, 1.05 * rays);
  EXPECT_GE(spent, 0.9 * rays);
}

TEST(ClassAllocation, KeepsThePilotsOfClassesWithoutError) {
  TwoClasses classes(5000, 0, 1, 1);
  const auto samples =
      ClassAllocation(classes.counts, {})
          .solve({.squared_error = 1000, .rays = no_limit, .kept = classes.kept}, classes.left, classes.found);
  EXPECT_GT(samples[first], 0u);
  EXPECT_EQ(samples[second], 0u);
}

/// Contrast without any find does not remain an error: it is learned from the first pixels.
TEST(ClassAllocation, LearnsFromWhatIsMeasured) {
  TwoClasses classes(0, 0, 1, 1);
  const ClassAllocation allocation(classes.counts, {});
  const ClassStatistics none{}, some{.pixels = 100, .own = 1};
  EXPECT_GT(allocation.variance(second, none), 300);
  EXPECT_NEAR(allocation.variance(second, some) / allocation.variance(second, none), 8.0 / 108, 1e-9);
  EXPECT_LT(allocation.variance(first, none), allocation.variance(second, none)) << "of lower contrast";
}

/// Pixels with edges at random places: half of the squared difference of independent halves is the error in the mean,
/// and the pixels that are not measured have as much.
TEST(ClassAllocation, EstimatesTheErrorOfHalvesWithoutBias) {
  oracle::Random random(11);
  constexpr double height = 40;
  constexpr int pixels = 40'000, samples = 8;
  TwoClasses classes(0, 0, 1, 1);
  const SampleDecay decay{.stratified = false};
  const ClassAllocation allocation(classes.counts, decay);
  ClassStatistics found;
  double truth = 0;
  for (int i = 0; i < pixels; ++i) {
    const double edge = random.in(0, 1);
    const auto half = [&] {
      double sum = 0;
      for (int j = 0; j < samples / 2; ++j) sum += random.chance(edge) ? height : 0;
      return sum / (samples / 2);
    };
    const double a = half(), b = half(), squared = (a - b) * (a - b) / 4;
    truth += std::pow((a + b) / 2 - edge * height, 2);
    if (i % 5 == 0)
      found.add({.pixels = 1, .error = squared, .squares = squared * squared, .own = decay.of(samples), .others = 0});
    else
      found.others += decay.of(samples);
  }
  const ClassAllocation::Estimate estimate = allocation.estimate(first, found);
  EXPECT_NEAR(estimate.squared, truth, 3 * std::sqrt(estimate.variance));
  EXPECT_LT(std::sqrt(estimate.variance), 0.05 * truth);
}

TEST(ClassAllocation, IsUncertainAboutAClassThatWasNotMeasured) {
  const TwoClasses classes(0, 0, 1, 1);
  const ClassAllocation::Estimate estimate = ClassAllocation(classes.counts, {}).estimate(second, {.others = 3});
  EXPECT_GT(estimate.squared, 0);
  EXPECT_DOUBLE_EQ(estimate.variance, estimate.squared * estimate.squared);
}

}  // namespace
}  // namespace tracer
