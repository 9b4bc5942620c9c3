/// The contract of leases, with the clock of the test.

#include "tests/conformance/job_store_conformance.h"

using namespace queue;

namespace {

constexpr std::int64_t kept = 1'000'000'000;  // how long expired jobs are kept: of no interest here

}  // namespace

TEST_P(JobStoreConformance, ClaimsAnAbandonedJobUnderANewFenceAtNoCost) {
  const std::string id = submit();
  const Claim first = claim();
  EXPECT_EQ(store().run_maintenance(lease_end, kept, 10).abandoned, std::vector{id});
  EXPECT_EQ(find(id).state, JobState::queued);
  EXPECT_EQ(find(id).attempt, 0);
  const Claim second = claim();
  EXPECT_EQ(second.job.id, id);
  EXPECT_EQ(second.job.attempt, 1);
  EXPECT_GT(second.fence, first.fence);
  EXPECT_FALSE(store().succeed(id, first.fence, now, "late", {}));
  EXPECT_FALSE(store().release(id, first.fence, now, {}));
  EXPECT_TRUE(store().succeed(id, second.fence, now, "{}", {}));
  EXPECT_EQ(find(id).report, "{}");
}

TEST_P(JobStoreConformance, AcceptsALateResultBeforeTheJobIsReleased) {
  const std::string id = submit();
  const Claim late = claim();
  EXPECT_TRUE(store().succeed(id, late.fence, lease_end + 5, "{}", {}));
  EXPECT_TRUE(store().run_maintenance(lease_end + 5, kept, 10).abandoned.empty());
  EXPECT_EQ(find(id).state, JobState::succeeded);
}

TEST_P(JobStoreConformance, LeasesHoldUntilTheirEndWhichARenewalMoves) {
  submit();
  submit();
  const Claim renewed = claim(), left = claim();
  EXPECT_TRUE(store().run_maintenance(lease_end - 1, kept, 10).abandoned.empty());
  const auto renew = [&](std::int64_t until) { return store().renew({{renewed.job.id, renewed.fence}}, until); };
  EXPECT_TRUE(renew(lease_end + 100).empty());
  EXPECT_EQ(find(renewed.job.id).revision, renewed.job.revision);
  EXPECT_EQ(store().run_maintenance(lease_end + 99, kept, 10).abandoned, std::vector{left.job.id});
  EXPECT_TRUE(renew(lease_end + 200).empty()) << "also after its end, before the job is released";
  EXPECT_TRUE(store().run_maintenance(lease_end + 199, kept, 10).abandoned.empty());
  EXPECT_EQ(store().run_maintenance(lease_end + 200, kept, 10).abandoned, std::vector{renewed.job.id});
}

TEST_P(JobStoreConformance, RenewingReturnsTheLostLeases) {
  const std::string ended = submit(), taken_back = submit(), again = submit(), removed = submit();
  std::vector<Lease> leases;
  for (int i = 0; i < 4; ++i) {
    const Claim claimed = claim();
    leases.push_back({claimed.job.id, claimed.fence});
  }
  store().succeed(ended, leases[0].fence, now, "{}", {});
  store().release(taken_back, leases[1].fence, now, {});
  store().cancel(taken_back, now);
  store().release(again, leases[2].fence, now, {});
  const Claim second = claim();
  ASSERT_EQ(second.job.id, again);
  store().finish_cancel(removed, leases[3].fence, now);
  store().remove(removed);
  EXPECT_EQ(store().renew(leases, lease_end + 100), leases);
  EXPECT_EQ(store().run_maintenance(lease_end, kept, 10).abandoned, std::vector{again})
      << "the new lease was not renewed";
}

TEST_P(JobStoreConformance, CancelsAJobAtTheEndOfItsLeaseIfRequested) {
  const std::string id = submit();
  claim();
  store().cancel(id, now);
  const MaintenanceResult result = store().run_maintenance(lease_end + 7, kept, 10);
  EXPECT_EQ(result.cancelled, std::vector{id});
  EXPECT_TRUE(result.abandoned.empty());
  EXPECT_EQ(find(id).state, JobState::cancelled);
  EXPECT_EQ(find(id).ended_at, lease_end + 7);
}

TEST_P(JobStoreConformance, ReleasesAbandonedJobsInSteps) {
  for (int i = 0; i < 5; ++i) submit();
  for (int i = 0; i < 5; ++i) claim();
  const MaintenanceResult first = store().run_maintenance(lease_end, kept, 3);
  EXPECT_EQ(first.abandoned.size(), 3u);
  EXPECT_TRUE(first.more);
  EXPECT_EQ(store().run_maintenance(lease_end, kept, 3).abandoned.size(), 2u);
  EXPECT_EQ(store().count(JobState::queued), 5);
}
