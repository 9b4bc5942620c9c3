// The error of a pixel is estimated without bias, whatever the samples before were, and sums of it are bounded as often
// as they say.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random.h"
#include "tracer/src/accuracy/account.h"

namespace tracer {
namespace {

/// A pixel half way between two edges: a sample is `low` or `high`, `high` with the given probability. All near one
/// place of the curve, so that its slope is one number.
struct TwoValued {
  double low = 0.5, high = 0.502, probability = 0.3;
  [[nodiscard]] double mean() const { return low + (high - low) * probability; }
  [[nodiscard]] double variance() const { return (high - low) * (high - low) * probability * (1 - probability); }
  double operator()(oracle::Random& random) const { return random.chance(probability) ? high : low; }
};

PixelState state(const TwoValued& value, double before, std::uint32_t count, std::uint32_t half,
                 oracle::Random& random) {
  PixelState pixel;
  pixel.sum = Color{before, 0, 0} * count;
  pixel.count = count;
  pixel.role = PixelState::Role::refined;
  for (std::size_t h = 0; h < 2; ++h) {
    for (std::uint32_t i = 0; i < half; ++i) pixel.fresh[h] += Color{value(random), 0, 0};
    pixel.fresh_count[h] = half;
  }
  return pixel;
}

TEST(PixelError, IsUnbiasedForSamplesThatAllMissedTheEdge) {
  const TwoValued value;
  const Levels levels({}, 1);
  oracle::Random random(3);
  constexpr int trials = 200'000;
  for (const std::uint32_t count : {1u, 4u, 16u}) {
    for (const std::uint32_t half : {1u, 3u}) {
      double before = 0, with = 0, truth = 0;
      for (int i = 0; i < trials; ++i) {
        const PixelState pixel = state(value, value.low, count, half, random);
        const PixelError error = error_of(pixel, levels);
        before += error.before / trials;
        with += error.with / trials;
        truth += std::pow(levels.slope(value.mean()) * (pixel.mean().r - value.mean()), 2) / trials;
      }
      const double missed = std::pow(levels.slope(value.mean()) * (value.low - value.mean()), 2);
      EXPECT_NEAR(before / missed, 1, 0.03) << count << " and " << half;
      EXPECT_NEAR(with / truth, 1, 0.03) << count << " and " << half;
    }
  }
}

TEST(PixelError, IsZeroWhereAllSamplesAgree) {
  PixelState pixel;
  pixel.sum = {0.3, 0.2, 0.1};
  pixel.count = 1;
  pixel.fresh = {Color{0.6, 0.4, 0.2}, Color{0.6, 0.4, 0.2}};
  pixel.fresh_count = {2, 2};
  const PixelError error = error_of(pixel, Levels({}, 1));
  EXPECT_NEAR(error.before, 0, 1e-20);
  EXPECT_NEAR(error.with, 0, 1e-20);
}

TEST(PixelError, CountsNothingThatIsClampedAwayAndSomethingThatMayNotBe) {
  const Levels levels({}, 9);
  PixelState pixel;
  pixel.sum = {9, 9, 9};
  pixel.count = 1;
  pixel.fresh_count = {1, 1};
  pixel.fresh = {Color{8, 8, 8}, Color{8.5, 8.5, 8.5}};
  EXPECT_EQ(error_of(pixel, levels).with, 0);
  pixel.fresh = {Color{0.1, 8, 8}, Color{0.1, 8, 8}};
  EXPECT_GT(error_of(pixel, levels).with, 0);
}

/// Pictures of pixels with edges: as often as stated at least, the truth is within the upper bound, and the estimate
/// itself is right in the mean.
TEST(Settling, BoundsTheTruthAsOftenAsItSays) {
  const TwoValued value;
  const Levels levels({}, 1);
  oracle::Random random(4);
  constexpr int pictures = 400;
  constexpr std::size_t count = 256;
  int covered = 0;
  double estimated = 0, true_sum = 0;
  for (int picture = 0; picture < pictures; ++picture) {
    std::vector<PixelState> pixels;
    double truth = 0;
    for (std::size_t i = 0; i < count; ++i) {
      pixels.push_back(state(value, value(random), 1, 4, random));
      truth += std::pow(levels.slope(value.mean()) * (pixels.back().mean().r - value.mean()), 2);
    }
    const SampledError error = settle(pixels, 16, levels);
    covered += truth <= error.squared_upper ? 1 : 0;
    estimated += error.squared;
    true_sum += truth;
  }
  EXPECT_NEAR(estimated / true_sum, 1, 0.03);
  EXPECT_GE(covered, 0.95 * pictures - 3 * std::sqrt(0.95 * 0.05 * pictures));
}

TEST(Settling, LetsAuditedPixelsStandForTheirLike) {
  const Levels levels({}, 1);
  std::vector<PixelState> pixels(64);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i].sum = {0.5, 0, 0};
    pixels[i].count = 1;
    pixels[i].variance = 1000;  // what was feared
    if (i % 4 != 0) continue;
    pixels[i].role = PixelState::Role::audited;
    pixels[i].fresh = {Color{0.501, 0, 0}, Color{0.501, 0, 0}};
    pixels[i].fresh_count = {1, 1};
  }
  const double each = std::pow(levels.slope(0.5) * 0.001, 2);
  EXPECT_NEAR(settle(pixels, 8, levels).squared / (64 * each), 1, 3e-3);
  for (const PixelState& pixel : pixels) EXPECT_LT(pixel.variance, 1000);
}

TEST(Settling, FearsTheWorstWhereNothingWasMeasured) {
  std::vector<PixelState> pixels(9);
  for (PixelState& pixel : pixels) pixel.count = 1, pixel.variance = 4;
  EXPECT_DOUBLE_EQ(settle(pixels, 3, Levels({}, 1)).squared, 36);
}

TEST(MissingLight, CountsWhatItWouldAddToThePicture) {
  const Levels levels({}, 1);
  MissingError missing;
  missing.add(0.25, 0.01, 0.02, levels);
  EXPECT_NEAR(std::sqrt(missing.depth), levels.level(0.26) - levels.level(0.25), 1e-9);
  EXPECT_NEAR(std::sqrt(missing.cutoff), levels.level(0.27) - levels.level(0.25), 1e-9);
  EXPECT_NEAR(std::sqrt(missing.both), levels.level(0.28) - levels.level(0.25), 1e-9);
}

TEST(ErrorEstimates, AddVariancesAndSquaredBiases) {
  const ErrorEstimate error =
      error_estimate({.squared = 3, .squared_upper = 12}, {.depth = 3, .cutoff = 27, .both = 36}, 4);
  EXPECT_DOUBLE_EQ(error.sampling, 1);
  EXPECT_DOUBLE_EQ(error.depth, 0.5);
  EXPECT_DOUBLE_EQ(error.cutoff, 1.5);
  EXPECT_DOUBLE_EQ(error.estimate, 2);
}

TEST(ErrorEstimates, LeaveToApproximationsWhatSamplesDoNotExplain) {
  ErrorEstimate error = error_estimate({.squared = 12, .squared_upper = 12}, {}, 4);
  add_approximation(error, {.squared = 60, .squared_upper = 60}, 4);
  EXPECT_DOUBLE_EQ(error.approximation, 2);
  EXPECT_DOUBLE_EQ(error.estimate, std::sqrt(5));
}

}  // namespace
}  // namespace tracer
