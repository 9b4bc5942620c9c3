// Estimates of errors by independent halves are free of bias, and the parts of an image's error add up.
#include "tracer/src/sampling/error_estimate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random.h"
#include "tracer/src/sampling/pixel_sums.h"

namespace tracer {
namespace {

/// A pixel with an edge, of which the pilot shows the darker side alone. Both sides are close, so that the slope of the
/// display transform is one number.
TEST(FreshError, OfPilotsThatAllMissedTheEdgeIsUnbiased) {
  constexpr double low = 0.5, high = 0.502, share = 0.3;
  const DisplayTransform display({}, 1);
  oracle::Random random(3);
  constexpr int trials = 200'000;
  for (const std::uint32_t count : {1u, 3u}) {
    double error = 0;
    const auto half = [&] {
      double sum = 0;
      for (std::uint32_t i = 0; i < count; ++i) sum += random.chance(share) ? high : low;
      return Color{sum / count, 0, 0};
    };
    for (int i = 0; i < trials; ++i) error += fresh_error({low, 0, 0}, {half(), half()}, display) / trials;
    const double mean = low + share * (high - low);
    EXPECT_NEAR(error / std::pow(display.slope(mean) * (mean - low), 2), 1, 0.03) << count;
  }
}

TEST(FreshError, IsZeroWhereOneHalfAgrees) {
  EXPECT_EQ(fresh_error({0.3, 0.2, 0.1}, {Color{0.3, 0.2, 0.1}, Color{0.9, 0.9, 0.9}}, DisplayTransform({}, 1)), 0);
}

TEST(ErrorEstimate, AddsVariancesAndSquaredBiases) {
  const ErrorEstimate error =
      error_estimate({.sampled = {3, 12}, .omitted = {.depth = 3, .cutoff = 27, .both = 36}}, 4);
  EXPECT_DOUBLE_EQ(error.sampling, 1);
  EXPECT_DOUBLE_EQ(error.depth, 0.5);
  EXPECT_DOUBLE_EQ(error.cutoff, 1.5);
  EXPECT_DOUBLE_EQ(error.estimate, 2);
}

TEST(ErrorEstimate, IncludesApproximations) {
  const ErrorEstimate error = error_estimate({.sampled = {12, 12}, .omitted = {}, .approximation = {30, 48}}, 4);
  EXPECT_DOUBLE_EQ(error.approximation, 2);
  EXPECT_DOUBLE_EQ(error.approximation_min, 1);
  EXPECT_DOUBLE_EQ(error.estimate, std::sqrt(5));
  const ErrorEstimate uncertain = error_estimate({.sampled = {12, 12}, .omitted = {}, .approximation = {20, 48}}, 4);
  EXPECT_EQ(uncertain.approximation_min, 0) << "the measurement does not exclude that there is none";
}

TEST(HalvesDistance, IsFreeOfNoiseThatBothHaveInCommon) {
  const DisplayTransform display({}, 1);
  const Color value{0.5, 0.5, 0.5}, bias{0.01, 0.01, 0.01}, noise{0.2, -0.1, 0.3};
  const HalvesDistance distance(value, {value + noise, value}, {value + noise + bias, value + bias}, display);
  EXPECT_NEAR(std::sqrt(distance.squared / 3), display.level(0.5) - display.level(0.49), 0.01);
  EXPECT_NEAR(distance.noise, 0, 1e-12);
}

TEST(HalvesDistance, IsUnbiasedAndHasTheVarianceOfAHalf) {
  const DisplayTransform display({}, 1);
  const double slope = display.slope(0.5), bias = 1e-4, deviation = 5e-4;
  oracle::Random random(7);
  double squared = 0, noise = 0;
  constexpr int trials = 100'000;
  const Color value{0.5, 0.5, 0.5};
  const auto fresh = [&] { return value + Color{1, 1, 1} * (bias + deviation * std::sqrt(3.0) * random.in(-1, 1)); };
  for (int i = 0; i < trials; ++i) {
    const HalvesDistance distance(value, {fresh(), fresh()}, {value, value}, display);
    squared += distance.squared / trials;
    noise += distance.noise / trials;
  }
  EXPECT_NEAR(squared, 3 * std::pow(slope * bias, 2), 0.02 * 3 * std::pow(slope * deviation, 2));
  EXPECT_NEAR(noise, 3 * std::pow(slope * deviation, 2), 0.03 * 3 * std::pow(slope * deviation, 2));
}

TEST(HalvesDistance, IsCloseInLevelsWhereTheNoiseIsAsLargeAsTheDistance) {
  const DisplayTransform display({}, 1);
  oracle::Random random(8);
  for (const auto& [own, limit] : {std::pair{0.05, 0.2}, {0.2, 0.05}, {0.01, 0.1}, {0.0, 0.05}}) {
    // Skewed as the light of paths is.
    const auto fresh = [&, limit = limit] {
      return Color{1, 1, 1} * (limit * (0.5 - 0.5 * std::log(random.in(1e-9, 1))));
    };
    const Color value = Color{1, 1, 1} * own;
    double squared = 0;
    constexpr int trials = 100'000;
    for (int i = 0; i < trials; ++i)
      squared += HalvesDistance(value, {fresh(), fresh()}, {value, value}, display).squared / trials;
    const double distance = display.level(limit) - display.level(own);
    EXPECT_NEAR(squared, 3 * distance * distance, 0.03 * 3 * distance * distance) << own << " " << limit;
  }
}

}  // namespace
}  // namespace tracer
