// Looks: their weighted errors are an unbiased estimate for any prediction, and the proven bound holds.
#include "tracer/src/sampling/looks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/support/random.h"

namespace tracer {
namespace {

/// `count` pixels with bounds that differ by a thousand, predictions that differ from them, and some pixels that are
/// refined or certified.
std::vector<PixelState> mixed_pixels(std::size_t count) {
  std::vector<PixelState> pixels(count);
  for (std::size_t i = 0; i < count; ++i) {
    PixelState& pixel = pixels[i];
    pixel.bound = std::exp2(static_cast<float>(i % 11));
    pixel.variance = std::exp2(static_cast<float>(i * 7919 % 13) - 8);
    pixel.edge = i % 9 == 0;
    pixel.certified = i % 5 == 0;
    if (i % 7 == 0) pixel.role = PixelState::Role::refined;
  }
  return pixels;
}

/// Errors within the bounds that are hardly correlated with the predictions.
std::vector<double> errors_of(const std::vector<PixelState>& pixels) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    errors.push_back(pixels[i].bound * std::pow(static_cast<double>(i * 7919 % 101) / 101, 8));
  return errors;
}

double sum_of_open(const std::vector<PixelState>& pixels, const std::vector<double>& errors) {
  double sum = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) sum += pixels[i].open() ? errors[i] : 0;
  return sum;
}

std::vector<FreshError> errors_at(const std::vector<Look>& looks, const std::vector<double>& errors) {
  std::vector<FreshError> at;
  for (const Look& look : looks) at.push_back({errors[look.place], errors[look.place]});
  return at;
}

struct Mean {
  double mean = 0, deviation = 0;
};
Mean mean_of(std::size_t trials, const std::function<double(std::uint64_t)>& value) {
  double sum = 0, squares = 0;
  for (std::uint64_t trial = 0; trial < trials; ++trial) {
    const double one = value(trial);
    sum += one;
    squares += one * one;
  }
  const auto count = static_cast<double>(trials);
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean) / count)};
}

TEST(Looks, EstimateTheSumOfTheErrorsOfOpenPixelsWithoutBias) {
  const std::vector<PixelState> pixels = mixed_pixels(3000);
  const std::vector<double> errors = errors_of(pixels);
  for (const std::size_t count : {1100u, 2000u, 8000u}) {
    const Mean estimate = mean_of(1000, [&](std::uint64_t stream) {
      auto copy = pixels;
      LookPool pool;
      const LookDraws draws = draw_looks(copy, count, stream, 7);
      pool.add(draws, errors_at(draws.looks, errors));
      return pool.estimate(copy).squared;
    });
    EXPECT_NEAR(estimate.mean, sum_of_open(pixels, errors), 4.5 * estimate.deviation) << count;
  }
}

TEST(Looks, StayUnbiasedWhenSomePixelsAreRefinedBetweenDraws) {
  const std::vector<PixelState> pixels = mixed_pixels(2000);
  const std::vector<double> errors = errors_of(pixels);
  auto later = pixels;
  for (std::size_t i = 0; i < later.size(); i += 3) later[i].role = PixelState::Role::refined;
  const Mean estimate = mean_of(1000, [&](std::uint64_t stream) {
    auto before = pixels, after = later;
    LookPool pool;
    const LookDraws first = draw_looks(before, 700, 2 * stream, 7);
    pool.add(first, errors_at(first.looks, errors));
    pool.begin_epoch();
    const LookDraws second = draw_looks(after, 500, 2 * stream + 1, 7);
    pool.add(second, errors_at(second.looks, errors));
    return pool.estimate(after).squared;
  });
  EXPECT_NEAR(estimate.mean, sum_of_open(later, errors), 4.5 * estimate.deviation);
}

/// A few pixels have all of the error, as with specks that the pilots missed. A look that finds one repairs it.
TEST(Looks, KeepWhatTheyFoundAfterItsRepair) {
  std::vector<PixelState> pixels(5000);
  for (PixelState& pixel : pixels) pixel.bound = 100;
  std::vector<double> errors(pixels.size());
  for (std::size_t i = 0; i < errors.size(); i += 250) errors[i] = 100;
  const Mean estimate = mean_of(400, [&](std::uint64_t stream) {
    auto state = pixels;
    LookPool pool;
    for (std::uint64_t round = 0; round < 3; ++round) {
      const LookDraws draws = draw_looks(state, 400, 3 * stream + round, 1);
      const std::vector<FreshError> found = errors_at(draws.looks, errors);
      pool.add(draws, found);
      for (std::size_t i = 0; i < found.size(); ++i) {
        if (!(found[i].squared > 0)) continue;
        state[draws.looks[i].place].role = PixelState::Role::refined;
        state[draws.looks[i].place].repaired = true;
      }
    }
    return pool.estimate(state).squared;
  });
  // Between the errors that remain and those at the start.
  EXPECT_GT(estimate.mean, 0.7 * 2000);
  EXPECT_LT(estimate.mean, 1.05 * 2000);
}

TEST(Looks, ProveABoundThatHolds) {
  const std::vector<PixelState> pixels = mixed_pixels(3000);
  const std::vector<double> errors = errors_of(pixels);
  const double truth = sum_of_open(pixels, errors);
  int broken = 0;
  constexpr int trials = 400;
  for (std::uint64_t trial = 0; trial < trials; ++trial) {
    auto state = pixels;
    LookPool pool;
    bool below = false;
    for (std::uint64_t i = 0; i < 20; ++i) {  // after each batch: the bound holds at any stop
      const LookDraws draws = draw_looks(state, 50, 20 * trial + i, 3);
      pool.add(draws, errors_at(draws.looks, errors));
      below = below || pool.proven() < truth;
    }
    broken += below ? 1 : 0;
  }
  EXPECT_LE(broken, 0.025 * trials + 3 * std::sqrt(0.025 * trials));
}

TEST(Looks, WithoutAFindProveThreeNthsOfTheBounds) {
  std::vector<PixelState> pixels(100'000);
  for (PixelState& pixel : pixels) pixel.bound = 12;
  LookPool pool;
  const LookDraws draws = draw_looks(pixels, 2000, 1, 0);
  pool.add(draws, std::vector<FreshError>(draws.looks.size()));
  const double bounds = 12 * 100'000.0;
  EXPECT_GT(pool.proven(), 3 * bounds / 2000);
  EXPECT_LT(pool.proven(), 8 * bounds / 2000);
}

TEST(Looks, AreNotTrustedIfTheyAreFewAndFindNothing) {
  const double bounds = 5000;
  SummedLooks sum;
  EXPECT_GT(sum.estimate(0, bounds).squared, 0.49 * bounds);
  EXPECT_NEAR(sum.estimate(98, bounds).squared, bounds * (1 / 100.0 - 1.0 / (looks_min + 2)), 1e-9);
  EXPECT_EQ(sum.estimate(looks_min, bounds).squared, 0);
  sum.add(70);
  EXPECT_GT(sum.estimate(10, bounds).squared, 0.08 * bounds) << "nor if they find little";
  sum.add(2 * bounds);
  EXPECT_DOUBLE_EQ(sum.estimate(10, bounds).squared, (70 + 2 * bounds) / 10);
}

TEST(Looks, HalveTheirAlphaInEachEpoch) {
  std::vector<PixelState> pixels(1000);
  LookPool pool;
  double alpha = 0.0125;
  for (int epoch = 0; epoch < 3; ++epoch, alpha /= 2) {
    ConfidenceSequence sequence(alpha);
    const LookDraws draws = pool.draw(pixels, 300, 0);
    pool.add(draws, std::vector<FreshError>(draws.looks.size()));
    for (std::size_t i = 0; i < draws.looks.size(); ++i) sequence.add(0);
    EXPECT_NEAR(pool.proven() / (sequence.upper_bound() * draws.range), 1, 1e-9) << epoch;
    pool.begin_epoch();
  }
}

TEST(Looks, AreNoneWhereNoPixelIsOpen) {
  std::vector<PixelState> pixels(10);
  for (PixelState& pixel : pixels) pixel.certified = true;
  EXPECT_TRUE(draw_looks(pixels, 5, 0, 0).looks.empty());
  EXPECT_TRUE(draw_looks(std::vector<float>(10), 5, 0, 0).looks.empty());
}

TEST(Looks, ByBoundsAloneAreOneInEachEqualPartOfTheirSum) {
  std::vector<float> bounds(900, 1);
  std::fill(bounds.begin() + 800, bounds.end(), 8.0F);  // half of the sum in the last 100
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const std::vector<Look> looks = draw_looks(bounds, 16, 0, seed).looks;
    ASSERT_EQ(looks.size(), 16U);
    for (std::size_t i = 0; i < 16; ++i) {
      const double part = i < 8 ? 100.0 * static_cast<double>(i) : 800 + 12.5 * static_cast<double>(i - 8);
      EXPECT_GE(looks[i].place, std::floor(part)) << i;
      EXPECT_LE(looks[i].place, std::floor(part + (i < 8 ? 100 : 12.5))) << i;
      EXPECT_DOUBLE_EQ(looks[i].weight, i < 8 ? 1600 : 200) << i;
    }
  }
}

TEST(Looks, AtOnePixelHaveDifferentSamples) {
  std::vector<PixelState> pixels(3);
  std::vector<std::uint32_t> seen(3);
  for (std::uint64_t stream = 0; stream < 3; ++stream)
    for (const Look& look : draw_looks(pixels, 20, stream, 0).looks) EXPECT_EQ(look.index, seen[look.place]++);
  EXPECT_EQ(seen[0] + seen[1] + seen[2], 60u);
}

}  // namespace
}  // namespace tracer
