// Selection of holdout pixels: their weighted errors are an unbiased estimate for any prediction.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tracer/src/sampling/sample_allocation.h"

namespace tracer {
namespace {

/// `count` pixels, every `step`th refined to 2^(2..6) samples with a variance that differs by a thousand.
std::vector<PixelState> partly_refined(std::size_t count, std::size_t step) {
  std::vector<PixelState> pixels(count);
  for (std::size_t i = 0; i < count; i += step) {
    pixels[i].role = PixelState::Role::refined;
    pixels[i].half_count.fill(2u << (i / step % 5));
    pixels[i].variance = std::exp2(static_cast<float>(i / step % 11));
  }
  return pixels;
}

/// Mean of the estimated sum of `errors` over many streams, and its standard error.
struct Estimate {
  double mean = 0, deviation = 0;
};
template <class Choose>
Estimate estimate(const std::vector<double>& errors, const Choose& choose) {
  constexpr std::uint64_t streams = 2000;
  double sum = 0, squares = 0;
  for (std::uint64_t stream = 0; stream < streams; ++stream) {
    double one = 0;
    for (const HoldoutPixel& pixel : choose(stream)) one += errors[pixel.place] * pixel.stands_for;
    sum += one;
    squares += one * one;
  }
  const double mean = sum / streams;
  return {mean, std::sqrt(std::max(0.0, squares / streams - mean * mean) / streams)};
}

/// Errors that are hardly correlated with the predictions.
std::vector<double> errors_of(std::size_t count) {
  std::vector<double> errors(count);
  for (std::size_t i = 0; i < count; ++i) errors[i] = std::pow(static_cast<double>(i * 7919 % 101), 2);
  return errors;
}

TEST(HoldoutSelection, IsUnbiasedForAnyPrediction) {
  const auto pixels = partly_refined(3000, 3);
  const std::vector<double> errors = errors_of(pixels.size());
  const double truth = std::accumulate(errors.begin(), errors.end(), 0.0);
  for (const HoldoutBudget budget : {HoldoutBudget{200, 100}, HoldoutBudget{3000, 256}, HoldoutBudget{20, 5}}) {
    const Estimate sum =
        estimate(errors, [&](std::uint64_t stream) { return select_holdout_pixels(pixels, budget, stream, 7); });
    EXPECT_NEAR(sum.mean, truth, 4.5 * sum.deviation) << budget.pixels << " pixels, " << budget.draws << " draws";
    EXPECT_LT(sum.deviation, 0.05 * truth);
  }
}

TEST(HoldoutSelection, IsUnbiasedWithoutPredictions) {
  for (const std::size_t pixels : {1u, 7u, 1000u}) {
    const std::vector<double> errors = errors_of(pixels);
    const double truth = std::accumulate(errors.begin(), errors.end(), 0.0);
    const Estimate sum =
        estimate(errors, [&](std::uint64_t stream) { return select_holdout_pixels(pixels, 64, stream, 3); });
    EXPECT_NEAR(sum.mean, truth, 4.5 * sum.deviation + 1e-12 * truth) << pixels;
  }
}

TEST(HoldoutSelection, HasLessVarianceIfPredictionsAreRight) {
  const auto pixels = partly_refined(20'000, 100);
  std::vector<double> errors(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) errors[i] = pixels[i].refined() ? pixels[i].variance : 0;
  const auto spread = [&](const HoldoutBudget& budget) {
    return estimate(errors, [&](std::uint64_t stream) { return select_holdout_pixels(pixels, budget, stream, 0); })
        .deviation;
  };
  EXPECT_LT(3 * spread({512, 256}), spread({2048, 0}));
}

TEST(HoldoutSelection, ContainsEveryCheapPixelOfASmallImage) {
  const auto pixels = partly_refined(2000, 5);
  const auto selection = select_holdout_pixels(pixels, full_holdout_budget(pixels.size()), 1, 0);
  std::vector<bool> selected(pixels.size());
  for (const HoldoutPixel& pixel : selection) selected[pixel.place] = true;
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_TRUE(selected[i] || pixels[i].count() > 8) << i;
}

TEST(HoldoutSelection, IsAscendingAndDiffersBetweenStreams) {
  const auto pixels = partly_refined(5000, 4);
  const auto one = select_holdout_pixels(pixels, {100, 50}, 1, 0),
             other = select_holdout_pixels(pixels, {100, 50}, 2, 0);
  const auto place = [](const HoldoutPixel& pixel) { return pixel.place; };
  EXPECT_TRUE(std::ranges::is_sorted(one, std::ranges::less_equal{}, place));
  EXPECT_FALSE(std::ranges::equal(one, other, {}, place, place));
}

TEST(HoldoutBudget, StaysWithinTheSamplesButAboveZero) {
  const auto pixels = partly_refined(50'000, 3);
  const auto cost = [&](const HoldoutBudget& budget) {
    double samples = 0;
    for (const HoldoutPixel& pixel : select_holdout_pixels(pixels, budget, 1, 0)) samples += 2 * pixel.half;
    return samples;
  };
  const double full = cost(full_holdout_budget(pixels.size()));
  for (const double fraction : {0.1, 0.3, 0.8})
    EXPECT_NEAR(cost(holdout_budget_within(pixels, fraction * full)), fraction * full, 0.15 * fraction * full)
        << fraction;
  EXPECT_EQ(holdout_budget_within(pixels, 1e9).draws, full_holdout_budget(pixels.size()).draws);
  EXPECT_GT(holdout_budget_within(pixels, 0).pixels, 0);
}

}  // namespace
}  // namespace tracer
