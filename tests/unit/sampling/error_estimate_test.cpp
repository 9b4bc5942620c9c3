// Estimates of a pixel's error are unbiased for any pilot, and the bounds of their sums hold at the stated confidence.
#include "tracer/src/sampling/error_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/random.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

/// A pixel with an edge: a sample is `high` with the given probability, else `low`. Both are close, so that the slope
/// of the display transform is one number.
struct TwoValued {
  double low = 0.5, high = 0.502, probability = 0.3;
  [[nodiscard]] double mean() const { return low + (high - low) * probability; }
  [[nodiscard]] double variance() const { return (high - low) * (high - low) * probability * (1 - probability); }
  double operator()(oracle::Random& random) const { return random.chance(probability) ? high : low; }
};

PixelState state(const TwoValued& value, PixelState::Role role, std::uint32_t half, oracle::Random& random) {
  PixelState pixel;
  pixel.pilot = {value.low, 0, 0};  // it missed the edge
  pixel.role = role;
  pixel.bound = 1;  // squared code values between both values
  for (std::size_t h = 0; h < 2; ++h) {
    for (std::uint32_t i = 0; i < half; ++i) {
      const Color sample{value(random), 0, 0};
      pixel.half[h] += sample;
      pixel.add_square(sample);
    }
    pixel.half_count[h] = half;
  }
  return pixel;
}

const InParallel one_by_one = [](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
  for (std::uint64_t i = 0; i < count; ++i) work(i);
};

TEST(PixelError, OfPilotsThatAllMissedTheEdgeIsUnbiased) {
  const TwoValued value;
  const DisplayTransform display({}, 1);
  oracle::Random random(3);
  constexpr int trials = 200'000;
  const double missed = value.mean() - value.low;
  for (const std::uint32_t half : {1u, 3u}) {
    double error = 0;
    for (int i = 0; i < trials; ++i) {
      const PixelState pixel = state(value, PixelState::Role::pilot, half, random);
      const Halves fresh{pixel.half[0] * (1.0 / half), pixel.half[1] * (1.0 / half)};
      error += fresh_error(pixel.pilot, fresh, display).squared / trials;
    }
    EXPECT_NEAR(error / std::pow(display.slope(value.mean()) * missed, 2), 1, 0.03) << half;
  }
}

TEST(PixelError, OfRefinedPixelsIsUnbiased) {
  const TwoValued value;
  const DisplayTransform display({}, 1);
  oracle::Random random(5);
  constexpr int trials = 200'000;
  for (const std::uint32_t half : {1u, 3u}) {
    double estimated = 0;
    for (int i = 0; i < trials; ++i)
      estimated += refined_error(state(value, PixelState::Role::refined, half, random), display) / trials;
    // The halves are independent, so the estimate is that of the variance.
    const double truth = std::pow(display.slope(value.mean()), 2) * value.variance() / (2 * half);
    EXPECT_NEAR(estimated / truth, 1, 0.03) << half;
  }
}

TEST(PixelError, IsZeroWhereAllSamplesAgree) {
  PixelState pixel;
  pixel.pilot = {0.3, 0.2, 0.1};
  pixel.half = {Color{0.6, 0.4, 0.2}, Color{0.6, 0.4, 0.2}};
  pixel.half_count = {2, 2};
  EXPECT_EQ(fresh_error(pixel.pilot, {Color{0.3, 0.2, 0.1}, Color{0.9, 0.9, 0.9}}, DisplayTransform({}, 1)).squared, 0);
  EXPECT_NEAR(refined_error(pixel, DisplayTransform({}, 1)), 0, 1e-20);
}

TEST(PixelError, IgnoresClampedRadianceOnly) {
  const DisplayTransform display({}, 9);
  PixelState pixel;
  pixel.half_count = {1, 1};
  pixel.half = {Color{8, 8, 8}, Color{8.5, 8.5, 8.5}};
  EXPECT_EQ(refined_error(pixel, display), 0);
  pixel.half = {Color{0.1, 8, 8}, Color{2.1, 8, 8}};
  EXPECT_GT(refined_error(pixel, display), 0);
}

/// Images of pixels with edges: the true error is below the upper bound at the stated confidence, and the estimate is
/// unbiased.
TEST(VarianceUpdate, BoundsTheErrorAtTheStatedConfidence) {
  const TwoValued value;
  const DisplayTransform display({}, 1);
  oracle::Random random(4);
  constexpr int images = 400;
  constexpr std::size_t count = 256;
  int covered = 0;
  double estimated = 0, true_sum = 0;
  for (int image = 0; image < images; ++image) {
    std::vector<PixelState> pixels;
    double truth = 0;
    for (std::size_t i = 0; i < count; ++i) {
      pixels.push_back(state(value, PixelState::Role::refined, 4, random));
      truth += std::pow(display.slope(value.mean()) * (pixels.back().mean().r - value.mean()), 2);
    }
    const SampledError error = update_variances({pixels, 16}, display, {}, one_by_one).estimated({});
    covered += truth <= error.squared_upper ? 1 : 0;
    estimated += error.squared;
    true_sum += truth;
  }
  EXPECT_NEAR(estimated / true_sum, 1, 0.03);
  EXPECT_GE(covered, 0.95 * images - 3 * std::sqrt(0.95 * 0.05 * images));
}

/// Share of images with `count` such pixels, one in two of a row, whose true error is below the upper bound.
double coverage(std::size_t count, const TwoValued& value, std::uint32_t half, const DisplayTransform& display) {
  oracle::Random random(count);
  constexpr int images = 2000;
  const RadianceInterval interval{
      .low = {static_cast<float>(value.low), 0, 0}, .high = {static_cast<float>(value.high), 0, 0}, .edge = true};
  int covered = 0;
  for (int image = 0; image < images; ++image) {
    std::vector<PixelState> pixels;
    double truth = 0;
    for (std::size_t i = 0; i < 6 * count; ++i) {
      PixelState pixel = state(value, PixelState::Role::refined, half, random);
      pixel.bound = squared_error_bound(interval, display);
      pixel.edge = true;
      if (i % 2 == 1 || i / 2 % 3 != 0) {
        pixel = {};
        pixel.pilot = {value.low, 0, 0};
        pixel.certified = true;
        pixel.bound = 0;
      }
      if (pixel.edge) truth += std::pow(display.level(pixel.mean().r) - display.level(value.mean()), 2);
      pixels.push_back(pixel);
    }
    const std::vector<RadianceInterval> bounds(pixels.size(), interval);
    const auto width = static_cast<std::uint32_t>(pixels.size());
    const SampledError error = update_variances({pixels, width, bounds}, display, {}, one_by_one).estimated({});
    covered += truth <= error.squared_upper ? 1 : 0;
  }
  return static_cast<double>(covered) / images;
}

/// Halves of a few pixels often agree by chance. These samples are independent: with stratified ones the true error is
/// smaller, which the estimate expects in part.
TEST(VarianceUpdate, BoundsTheErrorOfAFewPixels) {
  const DisplayTransform display({}, 1);
  for (const std::size_t count : {1, 2, 4, 8, 16}) EXPECT_GE(coverage(count, {}, 4, display), 0.92) << count;
}

/// All samples of most of these pixels miss the speck, and what they miss is hundreds of times brighter than white.
TEST(VarianceUpdate, BoundsTheErrorOfSpecksThatMostSamplesMiss) {
  const DisplayTransform display({}, 1);
  const TwoValued speck{.low = 0.05, .high = 20, .probability = 0.03};
  for (const std::size_t count : {1, 2, 4, 12}) EXPECT_GE(coverage(count, speck, 4, display), 0.92) << count;
}

TEST(SuspectedErrors, FollowTheNumberOfFinds) {
  SuspectedErrors errors;
  for (int i = 0; i < 10; ++i) errors.elsewhere.add({3, 1});
  errors.squared_shares = 10 * 0.25;
  EXPECT_DOUBLE_EQ(errors.expected().squared, 3) << "one in any case";
  errors.found_by_one = 4;
  errors.found_by_two = 3;
  errors.found_alone = 7;
  errors.squared_heights = {.squared = 12, .spread = 0, .largest = 2};
  EXPECT_DOUBLE_EQ(errors.expected().squared, 3 + (5 * 5 / 8.0 - 1) * 2 * 0.25) << "others are like those found";
  errors.squared_heights.squared = 1e6;
  EXPECT_DOUBLE_EQ(errors.expected().squared, 3 * 5 * 5 / 8.0) << "but within their bounds";
  errors.found_by_one = 40;
  EXPECT_DOUBLE_EQ(errors.expected().squared, 3 + 30) << "no more than there are";
  errors.near_finds.add({8, 4});
  errors.missed_near_finds = 0.5;
  EXPECT_DOUBLE_EQ(errors.expected().squared, 33 + 1.5 * 2);
}

TEST(PixelError, CountsHitsOfAnythingThatIsNotThePilot) {
  PixelState pixel;
  pixel.pilot = {0.25, 0.5, 0};
  pixel.role = PixelState::Role::refined;
  pixel.half_count = {8, 8};
  for (int i = 0; i < 16; ++i) {
    const Color sample = i % 5 == 0 ? Color{8, 0.5, 1} : pixel.pilot;
    pixel.half[static_cast<std::size_t>(i % 2)] += sample;
    pixel.add_square(sample);
  }
  EXPECT_NEAR(effective_hits(pixel), 4, 1e-4);
  EXPECT_NEAR(brightest_sample(pixel), (4 * 64 + 12 * 0.0625) / (4 * 8 + 12 * 0.25), 1e-4);
}

/// Squares of several sizes at random places in the pixel, whose samples are those of refined pixels.
TEST(PixelError, HasTheDeviationOfStratifiedHalves) {
  oracle::Random random(5);
  constexpr std::uint32_t half_samples = 512;
  constexpr double height = 8;
  for (const double side : {0.2, 0.5, 0.9}) {
    double truth = 0, stratified = 0, independent = 0;
    for (std::uint64_t key = 0; key < 200; ++key) {
      const double left = random.in(0, 1 - side), top = random.in(0, 1 - side);
      PixelState pixel;
      pixel.role = PixelState::Role::refined;
      pixel.half_count = {half_samples, half_samples};
      for (std::size_t i = 0; i < 2 * half_samples; ++i) {
        const Vec2 at = sequence_point(static_cast<std::uint32_t>(i / 2), mix(2 * key + i % 2 + 1));
        const bool hit = at.x >= left && at.x < left + side && at.y >= top && at.y < top + side;
        const Color sample = hit ? Color{height, 0, 0} : Color{};
        pixel.half[i % 2] += sample;
        pixel.add_square(sample);
      }
      truth += std::pow(pixel.mean().r - height * side * side, 2);
      stratified += std::pow(stratified_deviation_of_mean(pixel, 0), 2);
      independent += std::pow(deviation_of_mean(pixel, 0), 2);
    }
    EXPECT_GT(stratified, truth) << side;
    EXPECT_LT(stratified, 7 * truth) << side;
    EXPECT_GT(independent, 2 * stratified) << side;
  }
}

TEST(PixelError, HasAtLeastTheDeviationOfTheHalves) {
  PixelState pixel;
  pixel.role = PixelState::Role::refined;
  pixel.half_count = {128, 128};
  pixel.half[1] = {128, 0, 0};
  pixel.squares = {128, 0, 0};
  EXPECT_DOUBLE_EQ(stratified_deviation_of_mean(pixel, 0), 0.5);
}

TEST(PixelError, HasTheHeightOfWhatFewSamplesHit) {
  const DisplayTransform display({}, 1);
  for (const std::uint32_t hits : {1u, 2u, 5u, 15u}) {
    PixelState pixel;
    pixel.pilot = {0.5, 0.5, 0};
    pixel.role = PixelState::Role::refined;
    pixel.half_count = {8, 8};
    for (std::uint32_t i = 0; i < 16; ++i) {
      const Color sample = i < hits ? Color{0.502, 0.5, 0} : pixel.pilot;
      pixel.half[i % 2] += sample;
      pixel.add_square(sample);
    }
    EXPECT_NEAR(squared_height(pixel, display), std::pow(display.slope(0.501) * 0.002, 2), 0.02) << hits;
  }
}

TEST(PixelError, OfAMissedPartIsTheChangeOfTheDisplayedPixel) {
  const DisplayTransform display({}, 1);
  const RadianceInterval interval{.low = {0, 0.5F, 0.5F}, .high = {2, 0.5F, 0.5F}};
  const double error = missed_error({0.5, 0.5, 0.5}, interval, 0.1, display);
  EXPECT_NEAR(error, std::pow(display.level(0.65) - display.level(0.5), 2), 1e-9);
}

/// Features that cover a small part of the pixel, so that most pixels miss them in their first samples. Samples are
/// added where the prediction is large. The sum is not too small, because a pixel's own halves do not raise its
/// prediction; it is a little too large, because the mean of the others in its octave is smaller where its own value is
/// large.
TEST(VarianceUpdate, DoesNotUnderestimateWhenPredictionsDecideWhichPixelsGrow) {
  const TwoValued speck{.low = 0.5, .high = 0.502, .probability = 0.02};
  const DisplayTransform display({}, 1);
  oracle::Random random(9);
  double estimated = 0, true_sum = 0;
  for (int image = 0; image < 400; ++image) {
    std::vector<PixelState> pixels;
    for (std::size_t i = 0; i < 256; ++i) pixels.push_back(state(speck, PixelState::Role::refined, 4, random));
    update_variances({pixels, 16}, display, {}, one_by_one);
    std::vector<float> variances;
    for (const PixelState& pixel : pixels) variances.push_back(pixel.variance);
    std::nth_element(variances.begin(), variances.begin() + 128, variances.end());
    for (PixelState& pixel : pixels) {
      if (pixel.variance < variances[128]) continue;
      for (std::size_t h = 0; h < 2; ++h)
        for (; pixel.half_count[h] < 64; ++pixel.half_count[h]) pixel.half[h] += Color{speck(random), 0, 0};
    }
    estimated += update_variances({pixels, 16}, display, {}, one_by_one).refined.squared;
    for (const PixelState& pixel : pixels)
      true_sum += std::pow(display.slope(speck.mean()) * (pixel.mean().r - speck.mean()), 2);
  }
  EXPECT_GT(estimated / true_sum, 0.97);
  EXPECT_LT(estimated / true_sum, 1.2);
}

TEST(VarianceUpdate, PredictsPilotsFromLooksAtOthers) {
  const DisplayTransform display({}, 1);
  std::vector<PixelState> pixels(64);
  for (PixelState& pixel : pixels) pixel.pilot = {0.5, 0, 0};
  std::vector<LookError> looks;
  for (std::uint32_t i = 0; i < 64; i += 4) looks.push_back({i, i == 0 ? 80.0 : 2.0});
  update_variances({pixels, 8}, display, looks, one_by_one);
  EXPECT_NEAR(pixels[1].variance, (80 + 15 * 2) / 18.0, 1e-3);
  EXPECT_NEAR(pixels[0].variance, 15 * 2 / 17.0, 1e-3) << "without its own look";
}

/// The worst case: each pilot is one of two equally probable values, which are the ends of the interval.
TEST(VarianceUpdate, ExpectsTheGreatestVarianceWithinTheBoundsOfCertifiedPixels) {
  const DisplayTransform display({}, 1);
  const RadianceInterval interval{.low = {0.1F, 0.1F, 0.1F}, .high = {0.11F, 0.11F, 0.11F}};
  std::vector<PixelState> pixels(10);
  double truth = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const double end = i % 2 == 0 ? double{interval.low[0]} : double{interval.high[0]};
    const double mean = (double{interval.low[0]} + double{interval.high[0]}) / 2;
    pixels[i].pilot = {end, end, end};
    pixels[i].bound = squared_error_bound(interval, display);
    pixels[i].certified = true;
    truth += 3 * std::pow(display.level(end) - display.level(mean), 2);
  }
  const SampledParts parts = update_variances({pixels, 5}, display, {}, one_by_one);
  EXPECT_NEAR(parts.certified, 10 * double{pixels[0].bound}, 1e-3);
  EXPECT_NEAR(parts.estimated({}).squared_upper, truth, 0.02 * truth);
}

TEST(VarianceUpdate, AcceptsInfiniteContrast) {
  std::vector<PixelState> pixels(9);
  for (PixelState& pixel : pixels) pixel.contrast = std::numeric_limits<float>::infinity();
  update_variances({pixels, 3}, DisplayTransform({}, 1), {}, one_by_one);
  for (const PixelState& pixel : pixels) EXPECT_EQ(pixel.variance, pixel.bound);
}

TEST(OmittedError, IsTheChangeOfTheDisplayedImage) {
  const DisplayTransform display({}, 1);
  OmittedError omitted;
  omitted.add(0.25, 0.01, 0.02, display);
  EXPECT_NEAR(std::sqrt(omitted.depth), display.level(0.26) - display.level(0.25), 1e-9);
  EXPECT_NEAR(std::sqrt(omitted.cutoff), display.level(0.27) - display.level(0.25), 1e-9);
  EXPECT_NEAR(std::sqrt(omitted.both), display.level(0.28) - display.level(0.25), 1e-9);
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
