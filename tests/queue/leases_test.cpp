/// Leases: with a clock of the test, and with a supervisor whose job the store releases.

#include "tests/queue/supervised.h"

using namespace queue;

namespace {

constexpr std::int64_t lease_ms = 30'000;

class LeaseTest : public testing::Test {
 protected:
  Claim run_one() {
    (void)queue.submission.submit({.document = "{}"});
    return queue.lifecycle.claim().value();
  }
  JobState state(const Claim& claim) { return store.find(claim.job.id)->state; }

  std::atomic<std::int64_t> now = 1'700'000'000'000;
  TemporaryStores temporary;
  TestStore& store = temporary.store;
  IdSource ids{[this] { return now.load(); }, system_random()};
  Queue queue{store.all(), temporary.artifacts, ids, [this] { return now.load(); }, no_log(), {.lease_ms = lease_ms}};
};

class CountingTransitions final : public JobTransitions {
 public:
  explicit CountingTransitions(const JobTransitions& target) : JobTransitions(target) {}
  std::vector<Lease> renew(const std::vector<Lease>& leases, std::int64_t until) override {
    ++renewals;
    largest = std::max(largest, leases.size());
    return JobTransitions::renew(leases, until);
  }
  int renewals = 0;
  std::size_t largest = 0;
};

class RecordingRunner final : public JobRunner {
 public:
  void notify(bool) noexcept override { ++wakes; }
  void cancel(const std::string&) noexcept override {}
  void request_preview(const std::string&, std::uint32_t) noexcept override {}
  void on_lease_lost(const Lease& lease) noexcept override { lost_leases.push_back(lease); }
  std::string not_ready() override { return ""; }
  int wakes = 0;
  std::vector<Lease> lost_leases;
};

}  // namespace

TEST_F(LeaseTest, KeepsAJobRunningWhileItsLeaseIsRenewed) {
  const Claim claim = run_one();
  for (int round = 0; round < 10; ++round) {
    now += lease_ms - 1;
    queue.lifecycle.renew_leases();
    queue.lifecycle.run_maintenance();
    ASSERT_EQ(state(claim), JobState::running) << "round " << round;
  }
}

TEST_F(LeaseTest, QueuesAJobAgainAfterItsLeaseAndIgnoresItsLateResult) {
  RecordingRunner runner;
  queue.runner.attach(&runner);
  const Claim first = run_one();
  queue.lifecycle.set_progress(first.job.id, 0.5);
  const int wakes = runner.wakes;
  now += lease_ms;
  queue.lifecycle.run_maintenance();
  EXPECT_EQ(state(first), JobState::queued);
  EXPECT_EQ(queue.queries.progress(first.job.id), 0);
  EXPECT_GT(runner.wakes, wakes) << "the runner is notified";
  const Claim second = queue.lifecycle.claim().value();
  EXPECT_EQ(second.job.id, first.job.id);
  EXPECT_FALSE(queue.lifecycle.succeed(first.job.id, first.fence, "{}", {}));
  EXPECT_TRUE(queue.lifecycle.succeed(second.job.id, second.fence, "{}", {}));
}

TEST_F(LeaseTest, NotifiesTheRunnerOnceOfALostLease) {
  RecordingRunner runner;
  queue.runner.attach(&runner);
  const Claim claim = run_one();
  now += lease_ms;
  store.run_maintenance(now, 1, 10);  // another daemon on the same store
  queue.lifecycle.renew_leases();
  queue.lifecycle.renew_leases();
  EXPECT_EQ(runner.lost_leases, (std::vector<Lease>{{claim.job.id, claim.fence}}));
}

TEST_F(LeaseTest, CallsWaitersOfAJobThatIsCancelledAtTheEndOfItsLease) {
  const Claim claim = run_one();
  bool ended = false;
  queue.waiters.when_ended(claim.job.id, [&] { ended = true; });
  queue.lifecycle.cancel(claim.job.id);
  now += lease_ms;
  queue.lifecycle.run_maintenance();
  EXPECT_TRUE(ended);
  EXPECT_EQ(state(claim), JobState::cancelled);
}

TEST(Leases, CostOneWriteForAllRunningJobs) {
  TemporaryStores temporary;
  const Stores& all = temporary.store.all();
  CountingTransitions transitions(all.transitions);
  IdSource ids(system_clock(), system_random());
  Queue queue({all.jobs, all.statistics, transitions, all.batches, all.maintenance}, temporary.artifacts, ids,
              system_clock(), no_log(), {});
  for (int i = 0; i < 1000; ++i) (void)queue.submission.submit({.document = "{}"});
  queue.lifecycle.renew_leases();
  EXPECT_EQ(transitions.renewals, 0);
  std::vector<Claim> claims;
  for (int i = 0; i < 5; ++i) claims.push_back(queue.lifecycle.claim().value());
  queue.lifecycle.renew_leases();
  EXPECT_EQ(transitions.renewals, 1);
  EXPECT_EQ(transitions.largest, 5u);
  queue.lifecycle.succeed(claims[0].job.id, claims[0].fence, "{}", {});
  queue.lifecycle.fail(claims[1].job.id, claims[1].fence, {"internal", "", {}});
  queue.lifecycle.release(claims[2].job.id, claims[2].fence, {.counts = true});
  queue.lifecycle.cancel(claims[3].job.id);
  queue.lifecycle.finish_cancel(claims[3].job.id, claims[3].fence);
  queue.lifecycle.release(claims[4].job.id, claims[4].fence, {.counts = true});
  queue.lifecycle.renew_leases();
  EXPECT_EQ(transitions.renewals, 1) << "all have ended or were given back";
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
  Queue brief(store.all(), artifacts, ids, system_clock(), log.log(), {.lease_ms = 300});
  const QueueMaintainer maintenance(brief.lifecycle, log.log(),
                                    {std::chrono::milliseconds(2), std::chrono::milliseconds(1)});
  const LeaseRenewer renewal(brief.lifecycle, log.log(), std::chrono::milliseconds(20));
  const worker::Supervisor over(brief, settings(), log.log());
  const std::string id = brief.submission.submit({.document = "wait " + path("go")})->view.job.id;
  ASSERT_TRUE(eventually([&] { return state(id) == JobState::running; }));
  const std::int64_t claimed_at = find(id).started_at.value();
  ASSERT_TRUE(eventually([&] { return system_clock()() > claimed_at + 1000; }));
  create("go");
  ASSERT_TRUE(reaches(id, JobState::succeeded));
  EXPECT_EQ(find(id).started_at, claimed_at) << "never claimed again";
  EXPECT_EQ(log.count("lease_lost"), 0);
}
