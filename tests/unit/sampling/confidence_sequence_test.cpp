// Confidence sequences: coverage by exact binomial tests, closed forms, and the published wealth in long double.
#include "tracer/src/sampling/confidence_sequence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/binomial.h"
#include "tests/support/random.h"

namespace tracer {
namespace {

using oracle::Random;

constexpr double alpha = 0.05;

ConfidenceSequence sequence_of(const std::vector<double>& observations, double level = alpha) {
  ConfidenceSequence sequence(level);
  for (const double observation : observations) sequence.add(observation);
  return sequence;
}

double bound_of(const std::vector<double>& observations, double level = alpha) {
  return sequence_of(observations, level).upper_bound();
}

// ---- coverage ------------------------------------------------------------------------------------------------------

struct Distribution {
  std::string name;
  double mean;
  double (*draw)(Random&);
};

std::ostream& operator<<(std::ostream& out, const Distribution& distribution) { return out << distribution.name; }

double draw_bernoulli(Random& random, double p) { return random.chance(p) ? 1 : 0; }

/// Product of the distances of a pixel of value 1/2 to two independent halves of one sample each.
double draw_halves(Random& random) {
  const double one = draw_bernoulli(random, 0.2), other = draw_bernoulli(random, 0.2);
  return (0.5 - one) * (0.5 - other);
}

const std::vector<Distribution> distributions{
    {"Rare", 0.004, [](Random& random) { return draw_bernoulli(random, 0.004); }},
    {"Coin", 0.5, [](Random& random) { return draw_bernoulli(random, 0.5); }},
    {"Frequent", 0.97, [](Random& random) { return draw_bernoulli(random, 0.97); }},
    {"Constant", 0.3, [](Random& /*random*/) { return 0.3; }},
    {"Uniform", 0.5, [](Random& random) { return random.in(0, 1); }},
    {"HeavyTailed", 0.01, [](Random& random) { return std::pow(random.in(0, 1), 99); }},
    {"ProductOfHalves", 0.09, draw_halves},
    {"ImportanceSampled", 0.02,  // 1 % of the draws have a hundred times the usual value
     [](Random& random) { return random.chance(0.01) ? 1 : 1.0 / 99; }},
};

/// Returns false if any bound of a sequence is below the mean. W(mean) falls with each observation above the mean and
/// rises with others, so the bounds before those and the last one decide.
bool covers(const Distribution& distribution, double level, Random& random) {
  ConfidenceSequence sequence(level);
  for (int draw = 0; draw < 1000; ++draw) {
    const double observation = distribution.draw(random);
    if (observation > distribution.mean && sequence.upper_bound() < distribution.mean) return false;
    sequence.add(observation);
  }
  return sequence.upper_bound() >= distribution.mean;
}

statistics::Coverage coverage_of(const Distribution& distribution, double level) {
  statistics::Coverage coverage;
  for (std::uint64_t seed = 0; seed < 600; ++seed) {
    Random random(seed);
    coverage.add(covers(distribution, level, random));
  }
  return coverage;
}

class ConfidenceSequenceCoverage : public testing::TestWithParam<Distribution> {};

// An adversary who stops as soon as a bound is below the mean succeeds in these misses.
TEST_P(ConfidenceSequenceCoverage, HoldsUnderTheWorstStoppingRule) {
  for (const double level : {0.05, 0.3}) {
    const statistics::Coverage coverage = coverage_of(GetParam(), level);
    EXPECT_FALSE(coverage.rejected(1 - level)) << coverage.misses << " misses of " << coverage.trials;
  }
}

INSTANTIATE_TEST_SUITE_P(Distributions, ConfidenceSequenceCoverage, testing::ValuesIn(distributions),
                         [](const auto& tested) { return tested.param.name; });

TEST(ConfidenceSequence, MissesMoreOftenThanAHigherConfidenceAllows) {
  EXPECT_TRUE(coverage_of(distributions.front(), 0.5).rejected(0.95));
}

// Each find makes further ones likely, as when a region is examined closely after a find.
TEST(ConfidenceSequence, BoundsTheAverageOfMeansThatDependOnEarlierObservations) {
  statistics::Coverage coverage;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    Random random(seed);
    ConfidenceSequence sequence(alpha);
    bool covered = true, found = false;
    double means = 0;
    for (int draw = 1; draw <= 400; ++draw) {
      const double p = found ? 0.5 : 0.01;
      means += p;
      found = random.chance(p);
      sequence.add(found ? 1 : 0);
      covered = covered && sequence.upper_bound() >= means / draw;
    }
    coverage.add(covered);
  }
  EXPECT_FALSE(coverage.rejected(1 - alpha)) << coverage.misses << " misses of " << coverage.trials;
}

// ---- values --------------------------------------------------------------------------------------------------------

TEST(ConfidenceSequence, HasBetsOfAllWealth) {
  double sum = 0;
  for (const auto& bet : ConfidenceSequence::bets) {
    EXPECT_TRUE(bet.fraction > 0 && bet.fraction <= 1 && bet.weight > 0);
    sum += bet.weight;
  }
  EXPECT_LE(sum, 1);
  EXPECT_GT(sum, 1 - 1e-12);
}

TEST(ConfidenceSequence, OfZerosApproachesTheClosedFormFromAbove) {
  for (const double level : {0.05, 0.001})
    for (const int count : {1, 10, 100, 10'000, 1'000'000}) {
      const double bound = bound_of(std::vector<double>(static_cast<std::size_t>(count), 0.0), level);
      const double least = -std::expm1(std::log(level) / count);  // 1 - level^(1 / count): Clopper and Pearson 1934
      EXPECT_GT(bound, least) << count;
      EXPECT_LE(bound, 1.1 * least) << count;
    }
  EXPECT_LE(bound_of(std::vector<double>(3000, 0.0)), 3.3 / 3000);
}

TEST(ConfidenceSequence, IsTheRootOfThePublishedWealth) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<double> observations(1 + random.below(300));
    const double power = random.spread(0.1, 30);
    for (double& observation : observations)
      observation = random.chance(0.2) ? random.in(-0.25, 0) : std::pow(random.in(0, 1), power);
    const long double bound = bound_of(observations);
    long double wealth = 0;
    for (const auto& bet : ConfidenceSequence::bets) {
      // Waudby-Smith and Ramdas 2024, section 4: a capital process that bets `stake` on a mean below the bound.
      const long double stake = bet.fraction / (1 - bet.fraction * bound);
      long double capital = bet.weight;
      for (const double observation : observations) capital *= 1 + stake * (bound - observation);
      wealth += capital;
    }
    if (bound < 1) {
      EXPECT_NEAR(static_cast<double>(wealth * alpha), 1, 1e-6) << trial;
    } else {
      EXPECT_LE(wealth * alpha, 1) << trial;
    }
  }
}

/// Largest p with which at most `finds` of `draws` have at least the probability alpha (Clopper and Pearson 1934).
double exact_binomial_bound(std::uint64_t draws, std::uint64_t finds) {
  double low = 0, high = 1;
  while (high - low > 1e-9 * high) {
    const double p = low + (high - low) / 2;
    (1 - statistics::binomial_tail(draws, finds + 1, p) > alpha ? low : high) = p;
  }
  return high;
}

TEST(ConfidenceSequence, IsLittleWiderThanTheBoundOfAFixedNumber) {
  constexpr std::size_t draws = 10'000;
  for (const auto& [finds, factor] :
       std::vector<std::pair<std::size_t, double>>{{0, 1.1}, {1, 1.9}, {10, 1.55}, {100, 1.25}, {1000, 1.1}}) {
    std::vector<double> observations(draws, 0.0);
    std::fill_n(observations.begin(), finds, 1.0);
    const double exact = exact_binomial_bound(draws, finds), bound = bound_of(observations);
    EXPECT_GT(bound, exact) << finds;
    EXPECT_LT(bound, factor * exact) << finds;
  }
}

// ---- limits --------------------------------------------------------------------------------------------------------

TEST(ConfidenceSequence, IsOneWithoutInformation) {
  const ConfidenceSequence empty(alpha);
  EXPECT_EQ(empty.upper_bound(), 1);
  EXPECT_EQ(empty.mean(), 0);
  EXPECT_EQ(empty.count(), 0u);
  EXPECT_EQ(bound_of({1, 1, 1}), 1);
  EXPECT_LT(bound_of({0}), 1);
}

TEST(ConfidenceSequence, ClipsObservations) {
  std::vector<double> zeros(100, 0.0);
  const auto with = [&](double observation) {
    std::vector<double> observations = zeros;
    observations.push_back(observation);
    return sequence_of(observations);
  };
  for (const double high : {1.5, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(with(high).upper_bound(), with(1).upper_bound()) << high;
    EXPECT_EQ(with(high).mean(), with(1).mean()) << high;
  }
  EXPECT_EQ(with(-7).upper_bound(), with(-0.25).upper_bound());
  EXPECT_EQ(with(-std::numeric_limits<double>::infinity()).mean(), with(-0.25).mean());
}

TEST(ConfidenceSequence, IsNotNegative) {
  EXPECT_EQ(bound_of(std::vector<double>(1000, -0.25)), 0);
  EXPECT_EQ(sequence_of({-0.25, -0.25}).mean(), -0.25);
}

}  // namespace
}  // namespace tracer
