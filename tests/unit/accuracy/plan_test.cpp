// Samples go where they lower the error most for their cost, and no further than is asked.
#include "tracer/src/accuracy/plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace tracer {
namespace {

constexpr double any_cost = std::numeric_limits<double>::infinity();

std::vector<PixelState> pixels_of(std::initializer_list<double> variances, std::uint32_t count) {
  std::vector<PixelState> pixels;
  for (const double variance : variances) {
    PixelState& pixel = pixels.emplace_back();
    pixel.count = count;
    pixel.variance = static_cast<float>(variance);
    pixel.refined_before = true;
  }
  return pixels;
}

Adaptive within(std::uint32_t least, std::uint32_t most) {
  Adaptive limits;
  limits.samples_min = least;
  limits.samples_max = most;
  return limits;
}

double expected_after(const std::vector<PixelState>& pixels, const RoundPlan& plan) {
  double sum = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i)
    sum += double{pixels[i].variance} * pixels[i].count / (pixels[i].count + 2.0 * plan.half[i]);
  return sum;
}

TEST(Plan, GivesSamplesInProportionToTheDeviationOverTheRootOfTheCost) {
  auto pixels = pixels_of({100, 400, 400}, 1000);
  const std::vector<float> cost{1, 1, 4};
  const RoundPlan plan = plan_round(pixels, cost, {.squared_error = 300, .cost = any_cost}, within(1, 1u << 20), 1, 0);
  const auto total = [&](std::size_t i) { return 1000 + 2.0 * plan.half[i]; };
  EXPECT_NEAR(total(1) / total(0), 2, 0.01);
  EXPECT_NEAR(total(1) / total(2), 2, 0.01);
  EXPECT_NEAR(expected_after(pixels, plan), 300, 1);
}

TEST(Plan, ReachesItsGoalAndHardlyMore) {
  oracle::Random random(1);
  for (int round = 0; round < 50; ++round) {
    std::vector<PixelState> pixels(500);
    double sum = 0;
    for (PixelState& pixel : pixels) {
      pixel.count = 64 + random.below(64);
      pixel.variance = static_cast<float>(random.spread(0.1, 10));
      pixel.refined_before = true;
      sum += pixel.variance;
    }
    const std::vector<float> cost(pixels.size(), 3);
    const double goal = sum * random.in(0.3, 0.8);
    const RoundPlan plan = plan_round(pixels, cost, {.squared_error = goal, .cost = any_cost}, {}, 1, 0);
    EXPECT_LE(expected_after(pixels, plan), goal * 1.001);
    EXPECT_GE(expected_after(pixels, plan), goal * 0.97);
  }
}

TEST(Plan, LeavesPixelsAloneThatAreGoodEnough) {
  auto pixels = pixels_of({0, 0, 900, 0}, 4);
  const std::vector<float> cost(4, 1);
  const RoundPlan plan = plan_round(pixels, cost, {.squared_error = 300, .cost = any_cost}, {}, 1, 0);
  EXPECT_EQ(plan.half, (std::vector<std::uint32_t>{0, 0, 4, 0}));
  EXPECT_EQ(pixels[2].role, PixelState::Role::refined);
  EXPECT_EQ(pixels[0].role, PixelState::Role::retained);
}

TEST(Plan, KeepsToItsCost) {
  oracle::Random random(2);
  std::vector<PixelState> pixels(2000);
  std::vector<float> cost;
  for (PixelState& pixel : pixels) {
    pixel.count = 16;
    pixel.variance = static_cast<float>(random.spread(1, 100));
    pixel.refined_before = true;
    cost.push_back(static_cast<float>(random.spread(1, 30)));
  }
  const RoundPlan plan = plan_round(pixels, cost, {.squared_error = 0, .cost = 50'000}, {}, 1, 0);
  double spent = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) spent += 2.0 * plan.half[i] * cost[i];
  EXPECT_LE(spent, 50'000);
  EXPECT_GE(spent, 0.9 * 50'000);
}

TEST(Plan, KeepsToTheSamplesThatAreAllowed) {
  auto pixels = pixels_of({1e9, 1e9, 0}, 3);
  const std::vector<float> cost(3, 1);
  const RoundPlan plan = plan_round(pixels, cost, {.squared_error = 1e-9, .cost = any_cost}, within(9, 12), 1, 0);
  EXPECT_EQ(plan.half[0], 4u);  // 3 + 8 = 11; 13 would be too many
  EXPECT_EQ(plan.half[2], 3u);  // 3 + 6 = 9
}

TEST(Plan, LetsNoPixelGrowMoreThanWhatIsKnownOfIt) {
  auto pixels = pixels_of({1e9}, 2);
  const std::vector<float> cost(1, 1);
  EXPECT_LE(plan_round(pixels, cost, {.squared_error = 1e-9, .cost = any_cost}, {}, 1, 0).half[0], 7u);
}

TEST(Plan, AuditsSomeOfThePixelsThatWereNeverRefinedAndOthersEachRound) {
  std::vector<PixelState> pixels(4096);
  for (PixelState& pixel : pixels) pixel.count = 1;
  const std::vector<float> cost(pixels.size(), 1);
  std::size_t both = 0;
  const auto first = plan_round(pixels, cost, {.squared_error = 1, .cost = any_cost}, {}, 1, 7).half;
  const auto second = plan_round(pixels, cost, {.squared_error = 1, .cost = any_cost}, {}, 2, 7).half;
  std::size_t audits = 0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    audits += first[i] > 0 ? 1 : 0;
    both += first[i] > 0 && second[i] > 0 ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(audits), 1024, 100);
  EXPECT_NEAR(static_cast<double>(both), 256, 60);
}

}  // namespace
}  // namespace tracer
