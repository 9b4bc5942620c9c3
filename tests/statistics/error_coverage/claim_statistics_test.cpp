// The statistics that decide on claims, with synthetic claims and synthetic references.
#include "tests/statistics/error_coverage/claim_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/random.h"

namespace {

using namespace error_coverage;
using oracle::Random;

/// A claim of 1 level for a true error of `truth` levels.
Trial claim_of_one(double truth) {
  Trial trial;
  trial.claimed = 1;
  trial.error.squared = truth * truth;
  return trial;
}

double normal(Random& random) {
  return std::sqrt(-2 * std::log(random.in(1e-300, 1))) * std::cos(2 * 3.14159265358979 * random.in(0, 1));
}

/// A gray image of `value` levels with normal noise of standard deviation `noise`.
tracer::DisplayImage gray(double value, double noise, Random& random) {
  tracer::DisplayImage image{48, 32, std::vector<float>(3 * 48 * 32)};
  for (float& code : image.codes) code = static_cast<float>(tracer::codes_per_level * (value + noise * normal(random)));
  return image;
}

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
        EXPECT_NEAR(static_cast<double>(statistics::binomial_tail(trials, k, p) / tail), 1, 1e-12)
            << trials << " " << k;
      }
    }
}

TEST(ClaimStatistics, RejectsFromTheCountThatIsRarerThanAThousandth) {
  ClaimStatistics statistics{.trials = 25, .broken = 6};
  EXPECT_FALSE(statistics.rejected());  // probability 0.0012
  statistics.broken = 7;
  EXPECT_TRUE(statistics.rejected());  // probability 0.0002
  EXPECT_FALSE(ClaimStatistics{}.rejected());
}

TEST(ClaimStatistics, RejectsOneClaimBelowATenthOfTheTruth) {
  ClaimStatistics statistics;
  for (int i = 0; i < 400; ++i) statistics.add(claim_of_one(0.8));
  EXPECT_FALSE(statistics.rejected());
  statistics.add(claim_of_one(11));
  EXPECT_TRUE(statistics.rejected());
}

TEST(ClaimStatistics, CountsCloseClaimsAndExceededTargets) {
  ClaimStatistics statistics;
  for (const double truth : {0.3, 0.5, 1.0, 1.04, 1.2}) {
    Trial trial = claim_of_one(truth);
    trial.target = 1.1;
    statistics.add(trial);
  }
  EXPECT_EQ(statistics.close, 3u);
  EXPECT_EQ(statistics.broken, 2u);
  EXPECT_EQ(statistics.target_exceeded, 1u);
}

TEST(Trial, GrantsTheUncertaintyOfTheReferenceToTheClaim) {
  Trial trial = claim_of_one(1.1);
  EXPECT_TRUE(trial.broken());
  trial.error.standard_error = 0.15;  // of 1.21
  EXPECT_FALSE(trial.broken());
  trial.error.squared = -0.1;
  EXPECT_EQ(trial.truth(), 0);
}

TEST(Truth, IsUnbiasedByTheNoiseOfItsHalves) {
  Random random(3);
  double sum = 0, squares = 0, squared_standard_errors = 0;
  constexpr int repetitions = 200;
  for (int i = 0; i < repetitions; ++i) {
    const Truth truth(gray(100, 3, random), gray(100, 3, random));
    const MeasuredError error = truth.error_of(gray(101, 0, random));
    sum += error.squared;
    squares += error.squared * error.squared;
    squared_standard_errors += error.standard_error * error.standard_error;
  }
  const double mean = sum / repetitions, variance = squares / repetitions - mean * mean;
  EXPECT_NEAR(mean, 1, 4 * std::sqrt(variance / repetitions));
  // The channels of this noise are independent: the standard error may be sqrt(3) times too large, but not too small.
  EXPECT_GT(squared_standard_errors / repetitions, 0.9 * variance);
  EXPECT_LT(squared_standard_errors / repetitions, 4 * variance);
}

TEST(Truth, FindsTheWorstTile) {
  Random random(1);
  const tracer::DisplayImage exact = gray(100, 0, random);
  tracer::DisplayImage image = exact;
  image.codes[3 * (20 * 48 + 40)] +=
      static_cast<float>(48 * tracer::codes_per_level);  // 3 * 16 * 16 values in its tile
  const MeasuredError error = Truth(exact).error_of(image);
  EXPECT_NEAR(error.worst_tile, 3, 1e-3);
  EXPECT_NEAR(error.squared, 0.5, 1e-3);
}

}  // namespace
