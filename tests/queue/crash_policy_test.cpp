#include <gtest/gtest.h>

#include "server/worker/supervisor/failure_policy.h"

using namespace worker;
using Action = CrashDecision::Action;

namespace {

/// With three attempts at most.
CrashDecision decision(int attempt, std::size_t jobs, bool planned_shutdown = false, bool cancel_requested = false) {
  queue::Job job;
  job.attempt = attempt;
  job.cancel_requested = cancel_requested;
  return decide(job, jobs, "was killed by signal 11 (SIGSEGV)", planned_shutdown);
}

}  // namespace

TEST(CrashPolicy, CountsTheAttemptOfASingleJob) {
  EXPECT_EQ(decision(1, 1).action, Action::count_attempt);
  EXPECT_EQ(decision(2, 1).action, Action::count_attempt);
}

TEST(CrashPolicy, FailsASingleJobAfterItsLastAttemptWithTheSignal) {
  const CrashDecision last = decision(3, 1);
  EXPECT_EQ(last.action, Action::fail);
  EXPECT_EQ(last.problem.code, "worker_crashed");
  EXPECT_EQ(
      last.problem.detail,
      "The worker process was killed by signal 11 (SIGSEGV) while it ran this job and no other, in attempt 3 of 3.");
}

TEST(CrashPolicy, ReleasesSeveralJobsAsSuspects) {
  EXPECT_EQ(decision(3, 2).action, Action::release_as_suspect);
  EXPECT_EQ(decision(1, 2, false, true).action, Action::release_as_suspect);
}

TEST(CrashPolicy, ReleasesACancelledJob) { EXPECT_EQ(decision(3, 1, false, true).action, Action::release); }

TEST(CrashPolicy, CountsNoAttemptForAPlannedShutdown) {
  EXPECT_EQ(decision(3, 1, true).action, Action::release);
  EXPECT_EQ(decision(1, 2, true).action, Action::release);
}
