/// Leases: with a clock of the test, and with a supervisor whose job the store releases.

#include "tests/queue/supervised.h"

using namespace queue;

namespace {

constexpr std::int64_t lease_ms = 30'000;

class LeaseTest : public QueueFixture {
 protected:
  LeaseTest() : QueueFixture({.lease_ms = lease_ms}) { queue.runner.attach(&runner); }

  RecordingRunner runner;
};

}  // namespace

TEST_F(LeaseTest, QueuesAJobAgainOnceItsLeaseIsNotRenewedAndIgnoresItsLateResult) {
  const Claim first = submit_and_claim();
  queue.lifecycle.set_progress(first.job.id, 0.5);
  for (int round = 0; round < 10; ++round) {
    now += lease_ms - 1;
    queue.lifecycle.renew_leases();
    queue.lifecycle.run_maintenance();
    ASSERT_EQ(state(first.job.id), JobState::running) << "round " << round;
  }
  const int wakes = runner.notifications;
  now += lease_ms;
  queue.lifecycle.run_maintenance();
  EXPECT_EQ(state(first.job.id), JobState::queued);
  EXPECT_EQ(queue.queries.progress(first.job.id), 0);
  EXPECT_GT(runner.notifications, wakes) << "the runner is notified";
  const Claim second = queue.lifecycle.claim().value();
  EXPECT_EQ(second.job.id, first.job.id);
  EXPECT_FALSE(queue.lifecycle.succeed(first.job.id, first.fence, "{}", {}));
  EXPECT_TRUE(queue.lifecycle.succeed(second.job.id, second.fence, "{}", {}));
}

TEST_F(LeaseTest, NotifiesTheRunnerOnceOfALostLease) {
  const Claim claim = submit_and_claim();
  now += lease_ms;
  store.run_maintenance(now, 1, 10);  // another daemon on the same store
  queue.lifecycle.renew_leases();
  queue.lifecycle.renew_leases();
  EXPECT_EQ(runner.lost_leases, (std::vector<Lease>{{claim.job.id, claim.fence}}));
}

TEST_F(LeaseTest, CostOneWriteForAllRunningJobs) {
  for (int i = 0; i < 1000; ++i) (void)submit();
  queue.lifecycle.renew_leases();
  EXPECT_EQ(hooks.renewals, 0u);
  std::vector<Claim> claims;
  for (int i = 0; i < 5; ++i) claims.push_back(queue.lifecycle.claim().value());
  queue.lifecycle.renew_leases();
  EXPECT_EQ(hooks.renewals, 1u);
  EXPECT_EQ(hooks.leases_max, 5u);
  queue.lifecycle.succeed(claims[0].job.id, claims[0].fence, "{}", {});
  queue.lifecycle.fail(claims[1].job.id, claims[1].fence, {"internal", "", {}});
  queue.lifecycle.release(claims[2].job.id, claims[2].fence, {.counts = true});
  queue.lifecycle.cancel(claims[3].job.id);
  queue.lifecycle.finish_cancel(claims[3].job.id, claims[3].fence);
  queue.lifecycle.release(claims[4].job.id, claims[4].fence, {.counts = true});
  queue.lifecycle.renew_leases();
  EXPECT_EQ(hooks.renewals, 1u) << "all have ended or were given back";
}

TEST_F(SupervisorTest, StopsAndRepeatsAJobWhoseLeaseWasLostAtNoCost) {
  start(settings(1));
  const std::string id = submit("wait " + path("go"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 1; }));
  const std::int64_t after_the_lease = system_clock()() + 1'000'000;
  ASSERT_EQ(store.run_maintenance(after_the_lease, after_the_lease, 10).abandoned, std::vector{id});
  queue.lifecycle.renew_leases();
  ASSERT_TRUE(eventually([&] { return log.count("lease_lost") == 1 && state(id) == JobState::running; }));
  create("go");
  ASSERT_TRUE(reaches(id, JobState::succeeded));
  EXPECT_EQ(find(id).attempt, 1);
  EXPECT_EQ(log.count("job_cancelled") + log.count("attempt_failed") + log.count("job_failed"), 0);
}

TEST_F(SupervisorTest, RenewsTheLeasesOfLongJobs) {
  const auto renewal = renew_leases(queue.lifecycle, log.log(), std::chrono::milliseconds(1));
  start();
  const std::string id = submit("wait " + path("go"));
  EXPECT_TRUE(eventually([&] { return hooks.renewals >= 3; }));
  create("go");
  EXPECT_TRUE(reaches(id, JobState::succeeded));
  EXPECT_EQ(log.count("lease_lost"), 0);
}
