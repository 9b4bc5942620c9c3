// The requested error, divided among the parts of an image's error.
#include "tracer/src/sampling/error_goal.h"

#include <gtest/gtest.h>

namespace tracer {
namespace {

constexpr std::size_t pixel_count = 100;
constexpr double squared = 3 * pixel_count * 4.0;  // two levels in every channel

ErrorGoal goal() {
  Adaptive target;
  target.target_error = 2;
  return {target, pixel_count};
}

KnownErrors known(double mean, double upper, double fixed = 0) {
  KnownErrors errors;
  errors.sampled = {mean, upper};
  errors.fixed = fixed;
  return errors;
}

TEST(ErrorGoal, LeavesToSamplesWhatIsNotFixed) {
  EXPECT_DOUBLE_EQ(goal().of_round(known(squared, squared), squared, 1), 0.95 * squared);
  EXPECT_DOUBLE_EQ(goal().of_round(known(squared, squared, 0.25 * squared), squared, 1), 0.95 * 0.75 * squared);
}

TEST(ErrorGoal, IsThatOfTheFixedPartsIfTheyPreventTheTarget) {
  EXPECT_DOUBLE_EQ(goal().of_round(known(squared, squared, 2 * squared), squared, 1), 0.95 * 2 * squared);
}

/// Samples of the pixels that may be the brightest lower the part `tone`, at most to the half of what is left.
TEST(ErrorGoal, LeavesToSamplesWhatTheToneNeedNotHave) {
  KnownErrors errors = known(squared, squared);
  errors.tone = 0.1 * squared;
  EXPECT_DOUBLE_EQ(goal().of_round(errors, squared, 1), 0.95 * 0.9 * squared);
  errors.tone = 20 * squared;
  EXPECT_DOUBLE_EQ(goal().of_round(errors, squared, 1), 0.95 * 0.5 * squared);
}

TEST(ErrorGoal, AllowsAToneThatIsSmallBesideTheTargetAndTheSamples) {
  EXPECT_DOUBLE_EQ(goal().tone_max(known(0, 0)), squared / 8);
  EXPECT_DOUBLE_EQ(goal().tone_max(known(squared, 16 * squared)), 2 * squared);
}

TEST(ErrorGoal, IsLowerByTheUncertaintyOfTheEstimate) {
  EXPECT_DOUBLE_EQ(goal().of_round(known(0.8 * squared, squared), squared, 1), 0.8 * squared);
  EXPECT_DOUBLE_EQ(goal().of_round(known(0.1 * squared, squared), squared, 1), 0.5 * squared);
}

TEST(ErrorGoal, IsLowerIfPredictionsAreTooLow) {
  EXPECT_DOUBLE_EQ(goal().of_round(known(squared, squared), 0.5 * squared, 1), 0.95 * 0.5 * squared);
  EXPECT_DOUBLE_EQ(goal().of_round(known(squared, squared), 2 * squared, 1), 0.95 * squared);
}

/// Predictions of far smaller errors are too high: samples that reach them at once would be too many.
TEST(ErrorGoal, IsReachedInTwoStepsFromAfar) {
  EXPECT_DOUBLE_EQ(goal().of_round(known(3.9 * squared, 3.9 * squared), 3.9 * squared, 1), 0.95 * squared);
  EXPECT_DOUBLE_EQ(goal().of_round(known(4.1 * squared, 4.1 * squared), 4.1 * squared, 1), 0.95 * 2 * squared);
}

TEST(ErrorGoal, IsLowerInLateRounds) {
  double before = goal().of_round(known(squared, squared), squared, 3);
  EXPECT_DOUBLE_EQ(before, goal().of_round(known(squared, squared), squared, 1));
  for (std::uint32_t round = 4; round < 24; ++round) {
    const double now = goal().of_round(known(squared, squared), squared, round);
    EXPECT_NEAR(now, 0.8 * before, 1e-9 * before);
    before = now;
  }
}

TEST(ErrorGoal, IsLowerLaterForPaths) {
  Adaptive target;
  target.target_error = 1;
  const ErrorGoal paths(target, 100, ErrorGoal::rounds_of_paths);
  const double at_once = paths.of_round(known(300, 300), 300, 1);
  EXPECT_DOUBLE_EQ(paths.of_round(known(300, 300), 300, 5), at_once);
  EXPECT_NEAR(paths.of_round(known(300, 300), 300, 6), 0.8 * at_once, 1e-9);
}

TEST(ErrorGoal, CallsATwentiethLarge) {
  EXPECT_FALSE(goal().is_large(0.049 * squared));
  EXPECT_TRUE(goal().is_large(0.051 * squared));
}

}  // namespace
}  // namespace tracer
