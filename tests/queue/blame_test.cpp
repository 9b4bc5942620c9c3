#include <gtest/gtest.h>

#include "server/worker/supervisor/crash_policy.h"

using namespace worker;
using Action = CrashDecision::Action;

namespace {

std::vector<Action> actions(const std::vector<InFlightJob>& casualties, bool planned_shutdown = false) {
  std::vector<Action> result;
  for (const CrashDecision& verdict : decide(casualties, "was killed by signal 11 (SIGSEGV)", planned_shutdown)) {
    result.push_back(verdict.action);
  }
  return result;
}

}  // namespace

TEST(Blame, NobodyPaysWhenTheWorkerWasIdle) { EXPECT_TRUE(actions({}).empty()); }

TEST(Blame, AJobThatRanAlonePaysAnAttempt) {
  EXPECT_EQ(actions({{"a", 1, 1, 3, false}}), std::vector{Action::count_attempt});
  EXPECT_EQ(actions({{"a", 1, 2, 3, false}}), std::vector{Action::count_attempt});
}

TEST(Blame, AJobThatRanAloneInItsLastAttemptFailsAndTheSignalIsNamed) {
  const auto verdicts = decide({{"a", 1, 3, 3, false}}, "was killed by signal 11 (SIGSEGV)", false);
  ASSERT_EQ(verdicts.size(), 1u);
  EXPECT_EQ(verdicts[0].action, Action::fail);
  EXPECT_EQ(verdicts[0].problem.code, "worker_crashed");
  EXPECT_EQ(
      verdicts[0].problem.detail,
      "The worker process was killed by signal 11 (SIGSEGV) while it ran this job and no other, in attempt 3 of 3.");
}

TEST(Blame, OfSeveralNonePaysAndAllBecomeSuspects) {
  EXPECT_EQ(actions({{"a", 1, 3, 3, false}, {"b", 1, 1, 3, true}}),
            (std::vector{Action::give_back_suspect, Action::give_back_suspect}));
}

TEST(Blame, AJobThatWasBeingCancelledIsGivenBackAndSoCancelled) {
  EXPECT_EQ(actions({{"a", 1, 3, 3, true}}), std::vector{Action::give_back});
}

TEST(Blame, NobodyPaysForAnExcusedEnd) {
  EXPECT_EQ(actions({{"a", 1, 3, 3, false}}, true), std::vector{Action::give_back});
  EXPECT_EQ(actions({{"a", 1, 3, 3, false}, {"b", 1, 1, 3, false}}, true),
            (std::vector{Action::give_back, Action::give_back}));
}
