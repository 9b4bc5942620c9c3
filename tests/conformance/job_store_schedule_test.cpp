/// The contract of schedules and expiry: start times, deadlines, retention and maintenance.

#include "tests/conformance/job_store_conformance.h"

using namespace queue;

namespace {

constexpr std::int64_t kept_ms = 1000;

}  // namespace

std::vector<std::pair<std::string, std::function<void(const std::string& id)>>> JobStoreConformance::ends() {
  const auto claim_and_cancel = [this](const std::string& id) {
    const Claim claimed = claim();
    store().cancel(id, now);
    return claimed.fence;
  };
  std::vector<std::pair<std::string, std::function<void(const std::string& id)>>> all = {
      {"succeed", [this](auto&) { succeed_next(); }},
      {"fail", [this](auto&) { fail_next(); }},
      {"cancel", [this](auto& id) { store().cancel(id, now); }},
      {"finish_cancel", [this](auto& id) { store().finish_cancel(id, claim().fence, now); }},
      {"release when cancelled", [=, this](auto& id) { store().release(id, claim_and_cancel(id), now, {}); }},
      {"recover when cancelled",
       [=, this](auto& id) {
         claim_and_cancel(id);
         store().recover("other boot", now);
       }},
  };
  if (is_shared()) all.pop_back();
  return all;
}

TEST_P(JobStoreConformance, OneMinuteOfWaitingEqualsOnePointOfPriority) {
  const std::string early_low = submit([](Job& job) { job.priority = 40; });
  now += 10 * 60'000 + 1;
  const std::string late_high = submit([](Job& job) { job.priority = 50; });
  EXPECT_EQ(claim().job.id, early_low) << "ten minutes and a millisecond make up for ten points";
  now += 10 * 60'000 - 2;
  const std::string later_higher = submit([](Job& job) { job.priority = 60; });
  EXPECT_EQ(claim().job.id, later_higher) << "a millisecond less does not";
  EXPECT_EQ(claim().job.id, late_high);
}

TEST_P(JobStoreConformance, RanksADelayedJobFromItsStartTime) {
  const std::string delayed = submit([&](Job& job) { job.run_after = job.not_before = now + 60'000; });
  now += 30'000;
  const std::string later = submit();
  now += 40'000;
  store().run_maintenance(now, kept_ms, 10);
  EXPECT_EQ(claim().job.id, later) << "it has waited for 40 s, the other one for 10";
  EXPECT_EQ(claim().job.id, delayed);
}

TEST_P(JobStoreConformance, ClaimsNoJobBeforeItsTime) {
  const std::string id = submit([&](Job& job) { job.run_after = job.not_before = now + 10; });
  now += 9;
  EXPECT_FALSE(store().claim("boot", now, lease_end, false));
  EXPECT_FALSE(store().run_maintenance(now, kept_ms, 10).due);
  now += 1;
  const MaintenanceResult step = store().run_maintenance(now, kept_ms, 10);
  EXPECT_TRUE(step.due);
  EXPECT_FALSE(step.suspects_due);
  const Claim claimed = claim();
  EXPECT_EQ(claimed.job.id, id);
  EXPECT_EQ(claimed.job.not_before, std::nullopt);
  EXPECT_EQ(claimed.job.run_after, now) << "the requested time is kept";
  EXPECT_FALSE(store().run_maintenance(now, kept_ms, 10).due);
}

TEST_P(JobStoreConformance, ClaimsAReleasedJobAfterItsPause) {
  const Placed job = place(JobState::running);
  store().release(job.id, job.fence, now, {.counts = true, .suspect = true, .pause_ms = 5});
  reopen();
  EXPECT_EQ(find(job.id).not_before, now + 5);
  EXPECT_FALSE(store().run_maintenance(now + 4, kept_ms, 10).due);
  EXPECT_FALSE(store().claim("boot", now + 4, lease_end, true));
  now += 5;
  EXPECT_TRUE(store().run_maintenance(now, kept_ms, 10).suspects_due);
  EXPECT_EQ(claim(true).job.id, job.id);
}

TEST_P(JobStoreConformance, CancelsADelayedJob) {
  const std::string id = submit([&](Job& job) { job.not_before = now + 10; });
  EXPECT_EQ(store().cancel(id, now), CancelOutcome::cancelled);
  EXPECT_EQ(find(id).not_before, std::nullopt);
  EXPECT_FALSE(store().run_maintenance(now + 10, kept_ms, 10).due);
}

TEST_P(JobStoreConformance, FailsAQueuedJobAtItsDeadline) {
  const auto with_deadline = [&](Job& job) { job.deadline = now + 10; };
  const std::string waiting = submit(with_deadline), running = submit(with_deadline);
  store().cancel(waiting, now);
  EXPECT_EQ(claim().job.id, running);
  const std::string late = submit([&](Job& job) { job.deadline = now + 11, job.expires_in_s = 2; });
  const std::string overdue = submit(with_deadline);
  EXPECT_TRUE(store().run_maintenance(now + 9, kept_ms, 10).overdue.empty());
  EXPECT_EQ(store().claim("boot", now + 10, lease_end, false)->job.id, late) << "an overdue one is not begun";
  store().release(late, 1, now, {});
  EXPECT_EQ(store().run_maintenance(now + 10, kept_ms, 10).overdue, std::vector<std::string>{overdue});
  const Job failed = find(overdue);
  EXPECT_EQ(failed.state, JobState::failed);
  EXPECT_EQ(failed.problem->code, "deadline_exceeded");
  EXPECT_EQ(failed.ended_at, now + 10);
  EXPECT_EQ(find(running).state, JobState::running) << "its runner stops it";
  EXPECT_EQ(store().run_maintenance(now + 11, kept_ms, 10).overdue, std::vector<std::string>{late});
  EXPECT_EQ(find(late).expires_at, now + 11 + 2000);
  EXPECT_EQ(store().count(JobState::queued), 0);
}

TEST_P(JobStoreConformance, ReleasesTheEarliestDueJobsFirst) {
  const std::string later = submit([&](Job& job) { job.not_before = now + 2; });
  const std::string earlier = submit([&](Job& job) { job.not_before = now + 1; });
  now += 3;
  EXPECT_TRUE(store().run_maintenance(now, kept_ms, 1).more);
  EXPECT_EQ(claim().job.id, earlier);
  EXPECT_FALSE(store().claim("boot", now, lease_end, false));
  store().run_maintenance(now, kept_ms, 1);
  EXPECT_EQ(claim().job.id, later);
}

TEST_P(JobStoreConformance, RunsMaintenanceInStepsAndReportsMore) {
  for (int i = 0; i < 5; ++i) submit([&](Job& job) { job.deadline = now; });
  const MaintenanceResult first = store().run_maintenance(now, kept_ms, 3);
  EXPECT_EQ(first.overdue.size(), 3u);
  EXPECT_TRUE(first.more);
  EXPECT_EQ(store().run_maintenance(now, kept_ms, 3).overdue.size(), 2u);
  const MaintenanceResult last = store().run_maintenance(now, kept_ms, 3);
  EXPECT_TRUE(last.overdue.empty());
  EXPECT_FALSE(last.more);
}

TEST_P(JobStoreConformance, ComputesTheExpiryFromTheEnd) {
  for (const auto& [name, end] : ends()) {
    const std::string id = submit([](Job& job) { job.expires_in_s = 60; });
    end(id);
    EXPECT_EQ(find(id).expires_at, now + 60'000) << name;
  }
}

TEST_P(JobStoreConformance, DeletesDocumentAndImagesOfAnExpiredJobAndLaterItsRow) {
  const std::string sha256(64, 'a');
  const std::string id = submit([](Job& job) { job.expires_in_s = 1; });
  store().succeed(id, claim().fence, now, "{}", {{"image.png", "image/png", sha256, 5}});
  EXPECT_EQ(store().run_maintenance(now + 999, kept_ms, 10).expired, 0);
  const MaintenanceResult step = store().run_maintenance(now + 1000, kept_ms, 10);
  EXPECT_EQ(step.expired, 1);
  ASSERT_EQ(step.artifacts.size(), 1u);
  EXPECT_EQ(step.artifacts[0].sha256, sha256);
  reopen();
  EXPECT_TRUE(find(id).expired);
  EXPECT_EQ(find(id).state, JobState::succeeded);
  EXPECT_EQ(find(id).report, "{}");
  EXPECT_TRUE(find(id).artifacts.empty());
  EXPECT_FALSE(store().document(id));
  EXPECT_FALSE(store().is_artifact_referenced(sha256));
  EXPECT_EQ(store().owner_usage("").artifact_bytes, 0);
  EXPECT_EQ(store().run_maintenance(now + 1999, kept_ms, 10).deleted, 0);
  EXPECT_EQ(store().run_maintenance(now + 2000, kept_ms, 10).deleted, 1);
  EXPECT_FALSE(store().find(id));
  EXPECT_EQ(store().count(JobState::succeeded), 0);
}

TEST_P(JobStoreConformance, EndsNoJobBeforeItsStartWhenTheClockIsSetBack) {
  auto all = ends();
  all.emplace_back("deadline", [&](auto&) { store().run_maintenance(now + 1, kept_ms, 10); });
  for (const auto& [name, end] : all) {
    const std::string id = submit([&](Job& job) { job.created_at = now + 5000, job.deadline = now + 1; });
    end(id);
    const Job job = find(id);
    EXPECT_TRUE(ended(job.state)) << name;
    EXPECT_GE(job.ended_at.value(), job.started_at.value_or(job.created_at)) << name;
    EXPECT_GE(job.started_at.value_or(job.created_at), job.created_at) << name;
  }
}

TEST_P(JobStoreConformance, ExpiresJobsByTheTimeSinceTheirEnd) {
  const Retention retention{.expired_ms = 1000, .succeeded_ms = 500, .failed_ms = 200};
  const std::string succeeded = submit([&](Job& job) { job.expires_at = now + 1'000'000; });
  store().succeed(succeeded, claim().fence, now, "{}", {{"image.png", "image/png", std::string(64, 'a'), 5}});
  const std::string failed = submit();
  store().fail(failed, claim().fence, now + 1, {});
  const std::string cancelled = submit(), waiting = submit();
  store().cancel(cancelled, now + 2);
  EXPECT_EQ(store().run_maintenance(now + 200, retention, 10).aged, 0);
  EXPECT_EQ(store().run_maintenance(now + 201, retention, 10).aged, 1);
  EXPECT_TRUE(find(failed).expired);
  EXPECT_EQ(find(failed).expires_at, now + 201);
  EXPECT_EQ(store().run_maintenance(now + 499, retention, 10).aged, 1);
  EXPECT_TRUE(find(cancelled).expired);
  EXPECT_FALSE(find(succeeded).expired);
  EXPECT_EQ(store().run_maintenance(now + 500, retention, 10).artifacts.size(), 1u);
  EXPECT_TRUE(find(succeeded).expired) << "also with a later expires_at of its own";
  EXPECT_EQ(store().run_maintenance(now + 1500, retention, 10).deleted, 3);
  EXPECT_TRUE(store().document(waiting));
}

TEST_P(JobStoreConformance, ExpiresTheJobsThatEndedFirstWhenArtifactsAreTooLarge) {
  const auto finish = [&](char sha256, std::uint64_t bytes) {
    std::string id = submit();
    store().succeed(id, claim().fence, ++now, "{}", {{"image.png", "image/png", std::string(64, sha256), bytes}});
    return id;
  };
  const std::string first = finish('a', 100), equal = finish('a', 100), second = finish('b', 50), last = finish('c', 7);
  const auto run = [&](std::int64_t bytes, int limit = 10) {
    return store().run_maintenance(now, {.expired_ms = 1000, .artifact_bytes = bytes}, limit);
  };
  EXPECT_EQ(store().all().statistics.artifact_bytes(), 157) << "equal artifacts count once";
  EXPECT_EQ(run(157).evicted, 0);
  const MaintenanceResult part = run(156, 1);
  EXPECT_EQ(part.evicted, 1);
  EXPECT_TRUE(part.more) << "the other job has the same image";
  EXPECT_TRUE(find(first).expired);
  EXPECT_EQ(run(156).evicted, 1);
  EXPECT_TRUE(find(equal).expired);
  EXPECT_EQ(store().all().statistics.artifact_bytes(), 57);
  EXPECT_EQ(run(6).evicted, 2);
  EXPECT_TRUE(find(second).expired && find(last).expired);
  EXPECT_EQ(store().all().statistics.artifact_bytes(), 0);
  EXPECT_FALSE(run(0).more);
}

TEST_P(JobStoreConformance, DoesNotExpireJobsThatHaveNotEnded) {
  const std::string waiting = submit([&](Job& job) { job.expires_at = now; });
  const std::string running = submit([&](Job& job) { job.expires_at = now, job.priority = 60; });
  EXPECT_EQ(claim().job.id, running);
  EXPECT_EQ(store().run_maintenance(now + 1, kept_ms, 10).expired, 0);
  EXPECT_TRUE(store().document(waiting));
  EXPECT_TRUE(store().document(running));
}
