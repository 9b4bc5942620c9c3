#include <gtest/gtest.h>

#include "server/worker/supervisor/failure_policy.h"

using namespace worker;
using Action = CrashDecision::Action;

namespace {

std::vector<Action> actions(const std::vector<InFlightJob>& jobs, bool planned_shutdown = false) {
  std::vector<Action> result;
  for (const CrashDecision& decision : decide(jobs, "was killed by signal 11 (SIGSEGV)", planned_shutdown)) {
    result.push_back(decision.action);
  }
  return result;
}

}  // namespace

TEST(CrashPolicy, DecidesNothingForAnIdleWorker) { EXPECT_TRUE(actions({}).empty()); }

TEST(CrashPolicy, CountsTheAttemptOfASingleJob) {
  EXPECT_EQ(actions({{"a", 1, 1, 3, false}}), std::vector{Action::count_attempt});
  EXPECT_EQ(actions({{"a", 1, 2, 3, false}}), std::vector{Action::count_attempt});
}

TEST(CrashPolicy, FailsASingleJobAfterItsLastAttemptWithTheSignal) {
  const auto decisions = decide({{"a", 1, 3, 3, false}}, "was killed by signal 11 (SIGSEGV)", false);
  ASSERT_EQ(decisions.size(), 1u);
  EXPECT_EQ(decisions[0].action, Action::fail);
  EXPECT_EQ(decisions[0].problem.code, "worker_crashed");
  EXPECT_EQ(
      decisions[0].problem.detail,
      "The worker process was killed by signal 11 (SIGSEGV) while it ran this job and no other, in attempt 3 of 3.");
}

TEST(CrashPolicy, ReleasesSeveralJobsAsSuspects) {
  EXPECT_EQ(actions({{"a", 1, 3, 3, false}, {"b", 1, 1, 3, true}}),
            (std::vector{Action::release_as_suspect, Action::release_as_suspect}));
}

TEST(CrashPolicy, ReleasesACancelledJob) { EXPECT_EQ(actions({{"a", 1, 3, 3, true}}), std::vector{Action::release}); }

TEST(CrashPolicy, CountsNoAttemptForAPlannedShutdown) {
  EXPECT_EQ(actions({{"a", 1, 3, 3, false}}, true), std::vector{Action::release});
  EXPECT_EQ(actions({{"a", 1, 3, 3, false}, {"b", 1, 1, 3, false}}, true),
            (std::vector{Action::release, Action::release}));
}
