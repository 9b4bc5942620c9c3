/// The contract of retries, changes by the owner, quotas, replies and the result cache.

#include <atomic>

#include "tests/conformance/job_store_conformance.h"

using namespace queue;

namespace {

KeptReply reply_of(const std::string& owner, const std::string& key, std::int64_t expires_at) {
  return {{owner, "POST /v1/jobs", key}, "hash of " + key, {202, "/v1/jobs/7", "{\"id\": 7}"}, expires_at};
}

}  // namespace

TEST_P(JobStoreConformance, RetriesOnlyFailedAndCancelledJobs) {
  const std::vector<std::pair<JobState, RetryOutcome>> table = {
      {JobState::queued, RetryOutcome::not_ended},    {JobState::running, RetryOutcome::not_ended},
      {JobState::succeeded, RetryOutcome::succeeded}, {JobState::failed, RetryOutcome::queued},
      {JobState::cancelled, RetryOutcome::queued},
  };
  for (const auto& [from, outcome] : table) {
    const Placed job = place(from);
    EXPECT_EQ(store().retry(job.id, now), outcome) << name_of(from);
    EXPECT_EQ(find(job.id).state, outcome == RetryOutcome::queued ? JobState::queued : from) << name_of(from);
    if (from == JobState::running) store().finish_cancel(job.id, job.fence, now);
    store().remove(job.id);
  }
  EXPECT_EQ(store().retry("nobody", now), RetryOutcome::unknown);
}

TEST_P(JobStoreConformance, RetryResetsTheAttempts) {
  const std::string id = submit([&](Job& job) {
    job.expires_in_s = 60;
    job.deadline = now + 5;
    job.max_attempts = 1;
  });
  const Claim first = claim();
  store().fail(id, first.fence, now, {"internal", "x", {{"/a", "b", "c"}}});
  now += 10;
  const std::string other = submit();
  now += 10;
  store().retry(id, now);
  const Job job = find(id);
  EXPECT_EQ(job.attempt, 0);
  EXPECT_EQ(job.problem, std::nullopt);
  EXPECT_EQ(job.started_at, std::nullopt);
  EXPECT_EQ(job.ended_at, std::nullopt);
  EXPECT_EQ(job.expires_at, std::nullopt);
  EXPECT_EQ(job.deadline, std::nullopt) << "it has passed";
  EXPECT_EQ(claim().job.id, other) << "it waits since it was tried again";
  const Claim second = claim();
  EXPECT_EQ(second.job.id, id);
  EXPECT_EQ(second.document, first.document);
  EXPECT_GT(second.fence, first.fence);
  store().fail(id, second.fence, now, {"other", "y", {}});
  EXPECT_TRUE(find(id).problem->errors.empty()) << "those of the first time are gone";
}

TEST_P(JobStoreConformance, ARetriedSuspectStaysASuspect) {
  const Placed job = place(JobState::running);
  store().release(job.id, job.fence, now, {.counts = true, .suspect = true});
  store().cancel(job.id, now);
  store().retry(job.id, now);
  EXPECT_FALSE(store().claim("boot", now, lease_end, false));
  EXPECT_EQ(claim(true).job.id, job.id);
}

TEST_P(JobStoreConformance, DoesNotRetryAnExpiredJob) {
  const std::string id = submit([](Job& job) { job.expires_in_s = 1; });
  store().cancel(id, now);
  store().run_maintenance(now + 1000, 1000, 10);
  EXPECT_EQ(store().retry(id, now + 1000), RetryOutcome::expired);
}

TEST_P(JobStoreConformance, ChangesOnlyTheGivenFields) {
  const std::string id = submit([](Job& job) { job.name = "old", job.labels = {{"a", "1"}}; });
  const std::int64_t revision = find(id).revision;
  EXPECT_EQ(store().change(id, {80, "new", {{{"b", "2"}}}, {{now + 5}}}, revision), ChangeOutcome::changed);
  reopen();
  const Job job = find(id);
  EXPECT_EQ(job.priority, 80);
  EXPECT_EQ(job.name, "new");
  EXPECT_EQ(job.labels, (std::map<std::string, std::string>{{"b", "2"}}));
  EXPECT_EQ(job.expires_at, now + 5);
  EXPECT_GT(job.revision, revision);
  EXPECT_EQ(store().change(id, {}, std::nullopt), ChangeOutcome::changed);
  EXPECT_EQ(find(id).priority, 80);
  EXPECT_EQ(find(id).labels.size(), 1u);
  EXPECT_EQ(find(id).expires_at, now + 5);
  EXPECT_EQ(store().change(id, {{}, {}, {}, {std::optional<std::int64_t>()}}, std::nullopt), ChangeOutcome::changed);
  EXPECT_EQ(find(id).expires_at, std::nullopt);
  EXPECT_EQ(list({.state = {}, .labels = {{"b", "2"}}, .batch = {}, .text = "new"}), std::vector<std::string>{id});
}

TEST_P(JobStoreConformance, ChangesNothingOfAnotherRevision) {
  const std::string id = submit();
  const std::int64_t revision = find(id).revision;
  claim();
  EXPECT_EQ(store().change(id, {80, {}, {}, {}}, revision), ChangeOutcome::other_revision);
  EXPECT_EQ(find(id).priority, 50);
  EXPECT_EQ(store().change("nobody", {}, std::nullopt), ChangeOutcome::unknown);
}

TEST_P(JobStoreConformance, IncrementsTheRevisionWithEveryTransition) {
  const std::string id = submit();
  std::int64_t revision = find(id).revision;
  const auto expect_new = [&](const char* what) {
    EXPECT_GT(find(id).revision, revision) << what;
    revision = find(id).revision;
  };
  Claim claimed = claim();
  expect_new("claim");
  store().release(id, claimed.fence, now, {});
  expect_new("release");
  claimed = claim();
  expect_new("claim");
  store().cancel(id, now);
  expect_new("cancel");
  store().finish_cancel(id, claimed.fence, now);
  expect_new("finish_cancel");
  store().retry(id, now);
  expect_new("retry");
  store().cancel(id, now);
  expect_new("cancel while queued");
  store().retry(id, now);
  claimed = claim();
  revision = find(id).revision;
  if (is_shared()) {
    store().run_maintenance(lease_end, 1000, 10);
  } else {
    store().recover("other boot", now);
  }
  expect_new("recover");
  claimed = claim();
  revision = find(id).revision;
  store().succeed(id, claimed.fence, now, "{}", {});
  expect_new("succeed");
}

TEST_P(JobStoreConformance, ChangesThePriorityOfJobsThatHaveNotEnded) {
  const std::string first = submit(), second = submit();
  EXPECT_EQ(store().change(second, {51, {}, {}, {}}, std::nullopt), ChangeOutcome::changed);
  EXPECT_EQ(claim().job.id, second);
  store().cancel(first, now);
  EXPECT_EQ(store().change(first, {51, {}, {}, {}}, std::nullopt), ChangeOutcome::ended);
  EXPECT_EQ(store().change(first, {{}, "name", {}, {}}, std::nullopt), ChangeOutcome::changed);
}

TEST_P(JobStoreConformance, ReportsThePositionOfAJob) {
  const std::string low = submit([](Job& job) { job.priority = 10; });
  const std::string normal = submit();
  const std::string delayed = submit([&](Job& job) { job.not_before = now + 1; });
  const Placed suspect{claim().job.id, 1};
  EXPECT_EQ(suspect.id, normal);
  store().release(normal, 1, now, {.counts = true, .suspect = true});
  const std::string high = submit([](Job& job) { job.priority = 90; });
  EXPECT_EQ(store().queue_position(normal, 100), 0) << "suspects run first";
  EXPECT_EQ(store().queue_position(high, 100), 1);
  EXPECT_EQ(store().queue_position(low, 100), 2);
  EXPECT_EQ(store().queue_position(low, 1), 1) << "counted no further";
  EXPECT_EQ(store().queue_position(delayed, 100), std::nullopt);
  EXPECT_EQ(store().queue_position("nobody", 100), std::nullopt);
  EXPECT_EQ(claim().job.id, high);
  EXPECT_EQ(store().queue_position(high, 100), std::nullopt);
}

TEST_P(JobStoreConformance, ReportsTheDepthOfTheQueueAndItsOldestJob) {
  EXPECT_EQ(store().depth().oldest_at, std::nullopt);
  const std::int64_t began = now;
  const std::string oldest = submit();
  now += 100;
  submit([](Job& job) { job.priority = 90; });
  submit([&](Job& job) { job.run_after = job.not_before = now + 10; });
  QueueDepth depth = store().depth();
  EXPECT_EQ(depth.queued_by_priority, (std::map<int, std::int64_t>{{50, 2}, {90, 1}}));
  EXPECT_EQ(depth.delayed, 1);
  EXPECT_EQ(depth.oldest_at, began);
  store().change(oldest, {60, {}, {}, {}}, std::nullopt);
  EXPECT_EQ(store().depth().queued_by_priority, (std::map<int, std::int64_t>{{50, 1}, {60, 1}, {90, 1}}));
  store().remove(oldest);
  claim();
  now += 20;
  store().run_maintenance(now, 1000, 10);
  depth = store().depth();
  EXPECT_EQ(depth.queued_by_priority, (std::map<int, std::int64_t>{{50, 1}}));
  EXPECT_EQ(depth.delayed, 0);
  EXPECT_EQ(depth.oldest_at, began + 110) << "it could not run before";
}

TEST_P(JobStoreConformance, CountsTheUsageOfEachOwner) {
  const auto of = [](const std::string& owner) { return [owner](Job& job) { job.owner = owner; }; };
  const std::string first = submit(of("ann"));
  submit(of("ann"));
  submit(of("bob"));
  EXPECT_EQ(store().owner_usage("ann").queued_jobs, 2);
  EXPECT_EQ(store().owner_usage("bob").queued_jobs, 1);
  EXPECT_EQ(store().owner_usage("nobody").queued_jobs, 0);
  const std::vector<Artifact> images = {{"image.png", "image/png", "a", 70}, {"image.exr", "image/x-exr", "b", 7}};
  store().succeed(first, claim().fence, now, "{}", images);
  reopen();
  EXPECT_EQ(store().owner_usage("ann").queued_jobs, 1);
  EXPECT_EQ(store().owner_usage("ann").artifact_bytes, 77);
  EXPECT_EQ(store().owner_usage("bob").artifact_bytes, 0);
  store().remove(first);
  EXPECT_EQ(store().owner_usage("ann").artifact_bytes, 0);
}

TEST_P(JobStoreConformance, KeepsAReplyWithItsJobUntilItExpires) {
  const Job job = new_job();
  const KeptReply reply = reply_of("ann", "k", now + 10);
  EXPECT_FALSE(store().insert({{{job, "{}"}}, {}, reply}, now));
  reopen();
  const auto kept = store().find_reply(reply.key, now + 9);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->reply, reply.reply);
  EXPECT_EQ(kept->request_sha256, reply.request_sha256);
  EXPECT_FALSE(store().find_reply({"bob", "POST /v1/jobs", "k"}, now)) << "another's key is another key";
  EXPECT_FALSE(store().find_reply({"ann", "POST /v1/batches", "k"}, now));
  store().remove(job.id);
  EXPECT_TRUE(store().find_reply(reply.key, now)) << "the same answer, also when the job is gone";
  EXPECT_FALSE(store().find_reply(reply.key, now + 10));
  EXPECT_EQ(store().run_maintenance(now + 10, 1000, 10).deleted, 1);
}

TEST_P(JobStoreConformance, StoresNothingUnderAUsedKeyUntilItHasExpired) {
  const Job first = new_job(), second = new_job(), third = new_job();
  KeptReply reply = reply_of("ann", "k", now + 10);
  store().insert({{{first, "{}"}}, {}, reply}, now);
  reply.reply.body = "another";
  const auto earlier = store().insert({{{second, "{}"}}, {}, reply}, now + 9);
  ASSERT_TRUE(earlier);
  EXPECT_NE(earlier->reply.body, "another");
  EXPECT_FALSE(store().find(second.id));
  EXPECT_FALSE(store().insert({{{third, "{}"}}, {}, reply}, now + 10));
  EXPECT_TRUE(store().find(third.id));
}

TEST_P(JobStoreConformance, StoresOneOfManyConcurrentSubmissionsUnderOneKey) {
  std::atomic<int> stored = 0;
  const auto nodes = this->nodes();
  in_threads(8, [&](int thread) {
    const Job job = job_named("0190a5b0-0000-7000-8000-00000000000" + std::to_string(thread));
    stored += nodes[thread % 2]->insert({{{job, "{}"}}, {}, reply_of("ann", "k", now + 10)}, now) ? 0 : 1;
  });
  EXPECT_EQ(stored, 1);
  EXPECT_EQ(store().count(JobState::queued), 1);
}

TEST_P(JobStoreConformance, FindsTheNewestResultOfAContent) {
  const auto with_key = [](Job& job) { job.content_key = "key"; };
  const std::string older = submit(with_key), newer = submit(with_key);
  EXPECT_FALSE(store().find_by_content_key("key", now));
  store().succeed(older, claim().fence, now, "first", {{"image.png", "image/png", "a", 1}});
  EXPECT_EQ(store().find_by_content_key("key", now)->id, older) << "the newer one has not finished";
  store().succeed(newer, claim().fence, now, "second", {{"image.png", "image/png", "a", 1}});
  reopen();
  EXPECT_EQ(store().find_by_content_key("key", now)->report, "second");
  EXPECT_FALSE(store().find_by_content_key("other", now));
  store().change(newer, {{}, {}, {}, {{now + 10}}}, std::nullopt);
  EXPECT_EQ(store().find_by_content_key("key", now + 9)->id, newer);
  EXPECT_EQ(store().find_by_content_key("key", now + 10)->id, older);
}

TEST_P(JobStoreConformance, InsertsASucceededJob) {
  Job job = new_job();
  job.state = JobState::succeeded;
  job.started_at = job.ended_at = now;
  job.report = "{}";
  job.artifacts = {{"image.png", "image/png", std::string(64, 'a'), 5}};
  store().insert({{{job, "{}"}}, {}, {}}, now);
  EXPECT_EQ(find(job.id), job);
  EXPECT_TRUE(store().is_artifact_referenced(std::string(64, 'a')));
  EXPECT_EQ(store().owner_usage("").artifact_bytes, 5);
  EXPECT_FALSE(store().claim("boot", now, lease_end, false));
}
