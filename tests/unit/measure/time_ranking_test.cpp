// Order of measured times: the error rates of the comparison, and which points are timed again.
#include "tracer/src/measure/time_ranking.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/binomial.h"
#include "tests/support/random.h"

namespace tracer {
namespace {

using Runs = std::vector<double>;
using Indices = std::vector<std::size_t>;

TEST(CompareTimes, NeedsTwoPairs) {
  EXPECT_EQ(compare_times({}, {}), TimeOrder::uncertain);
  EXPECT_EQ(compare_times(Runs{1}, Runs{9}), TimeOrder::uncertain);
  EXPECT_EQ(compare_times(Runs{1, 1}, Runs{9}), TimeOrder::uncertain);
  EXPECT_EQ(compare_times(Runs{1, 1}, Runs{9, 9}), TimeOrder::different);
}

/// Runs whose differences relative to runs of one second are `differences`.
Runs runs_at(const Runs& differences) {
  Runs runs;
  for (const double difference : differences) runs.push_back((2 + difference) / (2 - difference));
  return runs;
}

TEST(CompareTimes, IsTheTTestOfTheRelativeDifferences) {
  // Three differences with a deviation of 0.1: the half width is 4.303 * 0.1 / sqrt(3) = 0.248, as t(2) = 4.303.
  const Runs ones{1, 1, 1};
  EXPECT_EQ(compare_times(ones, runs_at({0.15, 0.25, 0.35})), TimeOrder::different);
  EXPECT_EQ(compare_times(runs_at({0.15, 0.25, 0.35}), ones), TimeOrder::different);
  EXPECT_EQ(compare_times(ones, runs_at({0.146, 0.246, 0.346})), TimeOrder::uncertain);
}

TEST(CompareTimes, IsEqualIfNoDifferenceOfFivePercentIsPossible) {
  EXPECT_EQ(compare_times(Runs{1, 1}, Runs{1, 1}), TimeOrder::equal);
  EXPECT_EQ(compare_times(Runs{0, 0}, Runs{0, 0}), TimeOrder::equal);
  EXPECT_EQ(compare_times(Runs{1, 1, 1}, runs_at({-0.01, 0, 0.01})), TimeOrder::equal);
  EXPECT_EQ(compare_times(Runs{1, 1, 1}, runs_at({-0.1, 0, 0.1})), TimeOrder::uncertain);
}

TEST(CompareTimes, IgnoresALoadThatAffectsBothAlike) {
  EXPECT_EQ(compare_times(Runs{1, 3, 2}, Runs{1.1, 3.31, 2.2}), TimeOrder::different);
  EXPECT_EQ(compare_times(Runs{1, 3, 2}, Runs{1, 3.01, 2}), TimeOrder::equal);
}

TEST(CompareTimes, IsNotCertainByADisturbedRun) {
  EXPECT_EQ(compare_times(Runs{1, 1.01, 5}, Runs{1.2, 1.21, 1.22}), TimeOrder::uncertain);
  EXPECT_NE(compare_times(Runs{1, 9, 9, 9, 9}, Runs{1.1, 1.1, 1.1, 1.1, 1.1}), TimeOrder::different);
}

/// Normally distributed: Box and Muller 1958.
double normal(oracle::Random& random) {
  constexpr double turn = 6.283185307179586;
  return std::sqrt(-2 * std::log(1 - random.in(0, 1))) * std::cos(random.in(0, turn));
}

Runs noisy_runs(oracle::Random& random, std::size_t count, double mean) {
  Runs runs(count);
  for (double& run : runs) run = mean * (1 + 0.05 * normal(random));
  return runs;
}

TEST(CompareTimes, RanksEqualDistributionsInFivePercentOfCasesAtMost) {
  oracle::Random random(1);
  for (const std::size_t count : {2u, 3u, 6u}) {
    statistics::Coverage coverage;
    for (int trial = 0; trial < 2000; ++trial)
      coverage.add(compare_times(noisy_runs(random, count, 1), noisy_runs(random, count, 1)) != TimeOrder::different);
    EXPECT_FALSE(coverage.rejected(0.95)) << coverage.misses << " of " << coverage.trials << ", runs: " << count;
  }
}

TEST(CompareTimes, RanksADifferenceOfFourDeviationsWithSixPairs) {
  oracle::Random random(2);
  int ranked = 0;
  for (int trial = 0; trial < 1000; ++trial)
    ranked += compare_times(noisy_runs(random, 6, 1), noisy_runs(random, 6, 1.2)) == TimeOrder::different ? 1 : 0;
  EXPECT_GT(ranked, 990);
}

MeasuredPoint point(const Runs& runs) {
  return {.setting = {}, .seconds = *std::min_element(runs.begin(), runs.end()), .runs = runs};
}

TEST(UnrankedPoints, AreThoseWithOneRun) {
  EXPECT_EQ(unranked_points({}), Indices{});
  EXPECT_EQ(unranked_points(std::vector{point({1})}), Indices{0});
  EXPECT_EQ(unranked_points(std::vector{point({1, 1}), point({9}), point({5, 5})}), (Indices{1, 2}));
}

TEST(UnrankedPoints, AreNeighborsInTimeWhoseOrderIsUncertain) {
  const std::vector points{point({9, 9.1}), point({1, 1.3}), point({3, 3.5}), point({1.1, 1.3}), point({9, 9.09})};
  EXPECT_EQ(unranked_points(points), (Indices{1, 3}));
}

}  // namespace
}  // namespace tracer
