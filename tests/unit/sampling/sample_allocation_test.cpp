// Sample allocation: samples go where they lower the error most for their cost, up to the goal.
#include "tracer/src/sampling/sample_allocation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace tracer {
namespace {

constexpr double any_cost = std::numeric_limits<double>::infinity();

/// Makes the pixel refined, with `count` samples.
void refine(PixelState& pixel, std::uint32_t count) {
  pixel.role = PixelState::Role::refined;
  pixel.half_count = {count / 2, count / 2};
}

std::vector<PixelState> pixels_of(std::initializer_list<double> variances, std::uint32_t count) {
  std::vector<PixelState> pixels;
  for (const double variance : variances) {
    PixelState& pixel = pixels.emplace_back();
    refine(pixel, count);
    pixel.variance = static_cast<float>(variance);
  }
  return pixels;
}

/// Many pixels with eight samples and the same variance.
std::vector<PixelState> equal_pixels() {
  std::vector<PixelState> pixels(20'000);
  for (PixelState& pixel : pixels) {
    refine(pixel, 8);
    pixel.variance = 1;
  }
  return pixels;
}

Adaptive within(std::uint32_t least, std::uint32_t most) {
  Adaptive limits;
  limits.samples_min = least;
  limits.samples_max = most;
  return limits;
}

double predicted_error(const std::vector<PixelState>& pixels, const SampleAllocation& allocation) {
  double sum = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::uint32_t then = std::max(2 * allocation.half[i], pixels[i].count());
    sum += variance_of_one(pixels[i].variance, pixels[i].count()) / variance_of_one(1, then);
  }
  return sum;
}

TEST(SampleAllocation, IsProportionalToAPowerOfVarianceOverCost) {
  // Four times the variance, an octave of samples more or less where p = variance_power: 4^(1 / (1 + p)), rounded to
  // powers of two, over many pixels.
  std::vector<PixelState> pixels(2000);
  std::vector<float> cost;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    refine(pixels[i], 64);
    pixels[i].variance = static_cast<float>(std::exp2(static_cast<double>(i % 100) / 100) * (i < 1000 ? 1 : 4));
    cost.push_back(1);
  }
  const SampleAllocation allocation =
      allocate_samples(pixels, cost, {.squared_error = 1772, .cost = any_cost}, within(1, 1u << 20));
  double less = 0, more = 0;
  for (std::size_t i = 0; i < 1000; ++i) {
    less += std::log2(std::max(2.0 * allocation.half[i], 64.0)) / 1000;
    more += std::log2(std::max(2.0 * allocation.half[i + 1000], 64.0)) / 1000;
  }
  EXPECT_NEAR(more - less, 2 / (1 + variance_power), 0.1);
}

TEST(SampleAllocation, ReachesTheGoalAndLittleMore) {
  oracle::Random random(1);
  for (int round = 0; round < 20; ++round) {
    std::vector<PixelState> pixels(20'000);  // the rounding of each is a matter of chance
    double sum = 0;
    for (PixelState& pixel : pixels) {
      refine(pixel, 64);
      pixel.variance = static_cast<float>(random.spread(0.1, 10));
      sum += pixel.variance;
    }
    const std::vector<float> cost(pixels.size(), 3);
    const double goal = sum * random.in(0.3, 0.8);
    const SampleAllocation allocation =
        allocate_samples(pixels, cost, {.squared_error = goal, .cost = any_cost}, within(1, 4096));
    EXPECT_NEAR(predicted_error(pixels, allocation), goal, goal * 0.02);
  }
}

TEST(SampleAllocation, RaisesAPartOfPixelsWithEqualDemand) {
  std::vector<PixelState> pixels = equal_pixels();
  const std::vector<float> cost(pixels.size(), 1);
  const double goal = 0.9 * static_cast<double>(pixels.size());
  const SampleAllocation first =
      allocate_samples(pixels, cost, {.squared_error = goal, .cost = any_cost, .round = 1}, within(1, 4096));
  EXPECT_NEAR(predicted_error(pixels, first), goal, goal * 0.02);
  std::size_t both = 0, either = 0;
  const SampleAllocation second =
      allocate_samples(pixels, cost, {.squared_error = goal, .cost = any_cost, .round = 2}, within(1, 4096));
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    both += first.half[i] > 0 && second.half[i] > 0 ? 1 : 0;
    either += first.half[i] > 0 || second.half[i] > 0 ? 1 : 0;
  }
  EXPECT_LT(both, either / 2) << "each round chooses anew";
}

/// Suspected errors become smaller faster than found ones: fewer samples reach the same goal.
TEST(SampleAllocation, TakesFewerSamplesForSuspectedErrors) {
  std::vector<PixelState> pixels = equal_pixels();
  const std::vector<float> cost(pixels.size(), 1);
  const AllocationGoal goal{.squared_error = 0.25 * static_cast<double>(pixels.size()), .cost = any_cost};
  const auto mean_growth = [&] {
    const SampleAllocation allocation = allocate_samples(pixels, cost, goal, within(1, 4096));
    double sum = 0;
    for (const std::uint32_t half : allocation.half) sum += std::max(2 * half, 8u) / 8.0;
    return sum / static_cast<double>(pixels.size());
  };
  // Two powers of two take up to a sixth more than the optimum between them.
  const double found = mean_growth();
  EXPECT_GE(found, std::pow(4, 1 / variance_power) * 0.99);
  EXPECT_LE(found, std::pow(4, 1 / variance_power) * 1.16);
  for (PixelState& pixel : pixels) pixel.suspected = true;
  const double suspected = mean_growth();
  EXPECT_GE(suspected, std::pow(4, 1 / missed_power) * 0.99);
  EXPECT_LE(suspected, std::pow(4, 1 / missed_power) * 1.16);
}

TEST(SampleAllocation, SkipsPixelsThatReachTheGoal) {
  auto pixels = pixels_of({0, 0, 900, 0}, 4);
  const std::vector<float> cost(4, 1);
  const SampleAllocation allocation =
      allocate_samples(pixels, cost, {.squared_error = 500, .cost = any_cost}, within(1, 4096));
  EXPECT_EQ(allocation.half, (std::vector<std::uint32_t>{0, 0, 4, 0}));
}

TEST(SampleAllocation, StaysWithinTheCost) {
  oracle::Random random(2);
  std::vector<PixelState> pixels(20'000);
  std::vector<float> cost;
  for (PixelState& pixel : pixels) {
    refine(pixel, 16);
    pixel.variance = static_cast<float>(random.spread(1, 100));
    cost.push_back(static_cast<float>(random.spread(1, 30)));
  }
  const SampleAllocation allocation = allocate_samples(pixels, cost, {.squared_error = 0, .cost = 500'000}, {});
  double spent = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    spent += allocation.half[i] > 0 ? (2.0 * allocation.half[i] - 16) * cost[i] : 0;
  EXPECT_NEAR(spent, 500'000, 0.03 * 500'000);
}

TEST(SampleAllocation, StaysWithinTheSampleLimits) {
  const std::vector<float> cost(3, 1);
  const AllocationGoal low_error{.squared_error = 1e-9, .cost = any_cost};
  auto pixels = pixels_of({1e9, 1e9, 0}, 4);
  SampleAllocation allocation = allocate_samples(pixels, cost, low_error, within(9, 30));
  EXPECT_EQ(allocation.half[0], 8u);
  EXPECT_EQ(allocation.half[2], 8u);
  pixels = pixels_of({1e9, 1e9, 0}, 2);
  allocation = allocate_samples(pixels, cost, low_error, within(5, 7));  // no power of two in range
  EXPECT_EQ(allocation.half[0], 3u);
  EXPECT_EQ(allocation.half[2], 3u);
  pixels = pixels_of({1e9, 1e9, 0}, 2);
  EXPECT_TRUE(allocate_samples(pixels, cost, low_error, within(1, 3)).empty);
}

TEST(SampleAllocation, LimitsTheGrowthOfAPixel) {
  auto pixels = pixels_of({1e9}, 2);
  const std::vector<float> cost(1, 1);
  EXPECT_EQ(allocate_samples(pixels, cost, {.squared_error = 1e-9, .cost = any_cost}, within(1, 4096)).half[0], 8u);
}

TEST(SampleAllocation, RefinesOpenPixelsWithALargeBound) {
  std::vector<PixelState> pixels(4);
  const std::vector<float> cost(4, 1);
  for (std::size_t i = 0; i < 4; ++i) pixels[i].bound = i < 2 ? 100 : 10;
  pixels[1].certified = true;
  const SampleAllocation allocation =
      allocate_samples(pixels, cost, {.squared_error = 1, .cost = any_cost, .bound_max = 50}, within(1, 4096));
  EXPECT_EQ(allocation.half, (std::vector<std::uint32_t>{refined_half, 0, 0, 0}));
  EXPECT_TRUE(pixels[0].refined());
  EXPECT_TRUE(pixels[2].open());
}

TEST(SampleAllocation, IsAtItsMaximumIfPixelsWithTheMostSamplesHaveMostOfTheError) {
  Adaptive limits;
  limits.samples_max = 16;
  std::vector<PixelState> pixels(2);
  for (PixelState& pixel : pixels) pixel.role = PixelState::Role::refined;
  pixels[0].half_count = {8, 8};
  pixels[1].half_count = {4, 4};
  pixels[0].variance = 2;
  pixels[1].variance = 1;
  EXPECT_TRUE(at_maximum(pixels, limits));
  pixels[1].variance = 3;
  EXPECT_FALSE(at_maximum(pixels, limits));
}

}  // namespace
}  // namespace tracer
