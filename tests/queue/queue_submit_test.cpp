/// Submissions: quotas of owners, idempotency keys, batches and the result cache.

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <mutex>

#include "server/queue/asset_store.h"
#include "tests/queue/queue_fixture.h"
#include "tests/support/threads.h"

using namespace queue;

namespace {

class SubmitTest : public QueueFixture {
 protected:
  SubmitTest()
      : QueueFixture({.queued_limit = 100,
                      .owner_queued_limit = 3,
                      .owner_artifact_bytes_limit = 10,
                      .reply_kept_ms = 1000,
                      .retention = {.expired_ms = 1000}}) {
    hooks.before = [this](std::string_view call, bool durable) {
      const std::lock_guard lock(mutex_);  // some tests submit from several threads
      if (call == "probe") {
        ++probes;
      } else {
        durable_writes.push_back(durable);
      }
    };
  }
  static Submission submission(const std::string& content_key = "", const std::string& owner = "") {
    Submission result;
    result.document = "{}";
    result.job.content_key = content_key;
    result.job.owner = owner;
    return result;
  }
  bool run_one(const std::string& image) {
    const auto claim = queue.lifecycle.claim();
    return claim && succeed(*claim, image);
  }

  std::vector<bool> durable_writes;  ///< durability of all writes, in order
  int probes = 0;

 private:
  std::mutex mutex_;
};

}  // namespace

TEST_F(SubmitTest, EnforcesTheLimitsOfEachOwner) {
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(queue.submission.submit(submission("", "ann")));
  const auto refused = queue.submission.submit(submission("", "ann"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Rejection::Reason::owner_queued_jobs);
  EXPECT_EQ(refused.error().value, 3);
  EXPECT_TRUE(queue.submission.submit(submission("", "bob"))) << "another's bound";
  EXPECT_TRUE(run_one("0123456789"));
  const auto full = queue.submission.submit(submission("", "ann"));
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().reason, Rejection::Reason::owner_artifact_bytes);
  EXPECT_EQ(full.error().value, 10);
}

TEST_F(SubmitTest, FinishesAJobFromTheResultCacheWithReportAndImages) {
  EXPECT_FALSE(queue.submission.submit(submission("key"))->from_cache);
  EXPECT_FALSE(queue.submission.submit(submission("key"))->from_cache) << "the first one has not finished";
  EXPECT_TRUE(run_one("abc"));
  const Submitted hit = *queue.submission.submit(submission("key"));
  EXPECT_TRUE(hit.from_cache);
  EXPECT_EQ(hit.view.progress, 1);
  EXPECT_EQ(hit.view.job.report, "{}");
  EXPECT_NE(queue.queries.open(hit.view.job.artifacts.at(0)), nullptr);
  EXPECT_FALSE(queue.lifecycle.claim()) << "the second one ends with the result of the first";
  EXPECT_EQ(store.count(JobState::succeeded), 3);
  EXPECT_FALSE(queue.submission.submit(submission("other"))->from_cache);
  EXPECT_FALSE(queue.submission.submit(submission(""))->from_cache);
}

TEST_F(SubmitTest, KeepsCachedImagesWhenTheirFirstJobIsRemoved) {
  std::atomic<int> hits = 0, missing = 0;
  std::atomic<bool> stop = false;
  in_threads(4, [&](int) {
    while (!stop) {
      const auto submitted = queue.submission.submit(submission("key", ids.next()));
      if (!submitted) continue;
      const Job& job = submitted->view.job;
      if (submitted->from_cache) {
        if (queue.queries.open(job.artifacts.at(0)) == nullptr) ++missing;
        if (++hits >= 2000) stop = true;
      } else {
        run_one("abc");
      }
      queue.lifecycle.remove(job.id);
    }
  });
  EXPECT_EQ(missing, 0);
}

TEST_F(SubmitTest, DeletesAReplyAfterItsTime) {
  const auto submit = [&](const std::string& hash) {
    Submission keyed = submission();
    keyed.idempotency = Idempotency{"POST /v1/jobs", "k", hash};
    keyed.write_reply = [](const JobView& view, bool) { return FirstReply{202, "", view.job.id}; };
    return queue.submission.submit(std::move(keyed));
  };
  const std::string first = submit("a")->view.job.id;
  EXPECT_EQ(submit("a")->replayed->body, first);
  EXPECT_EQ(submit("b").error().reason, Rejection::Reason::key_reused);
  now += 1000;
  EXPECT_FALSE(submit("b")->replayed);
}

TEST_F(SubmitTest, MaintenanceDeletesExpiredImagesThatNoOtherJobNames) {
  Submission kept = submission("key"), expiring = submission("key");
  expiring.job.expires_in_s = 1;
  expiring.job.cache = api::CacheUse::off;
  const std::string first = queue.submission.submit(std::move(kept))->view.job.id;
  EXPECT_TRUE(run_one("abc"));
  const std::string second = queue.submission.submit(std::move(expiring))->view.job.id;
  EXPECT_TRUE(run_one("abc"));
  const Artifact image = queue.queries.find(first)->job.artifacts.at(0);
  now += 1000;
  EXPECT_FALSE(queue.lifecycle.run_maintenance());
  EXPECT_TRUE(queue.queries.find(second)->job.expired);
  EXPECT_NE(queue.queries.open(image), nullptr) << "the first job still has it";
  EXPECT_EQ(queue.lifecycle.remove(first), RemoveOutcome::removed);
  EXPECT_EQ(queue.queries.open(image), nullptr);
}

TEST_F(SubmitTest, CancelsABatchWithTooManyFailedJobs) {
  BatchSubmission batch;
  batch.jobs.resize(3);
  batch.batch.max_failed = 1;
  const std::string id = queue.submission.submit_batch(std::move(batch))->state.batch.id;
  for (const std::int64_t left : {2, 0}) {
    const Claim claim = *queue.lifecycle.claim();
    queue.lifecycle.fail(claim.job.id, claim.fence, {"internal", "x", {}});
    EXPECT_EQ(store.count(JobState::queued), left);
  }
  EXPECT_EQ(queue.queries.find_batch(id)->jobs,
            (std::map<JobState, std::int64_t>{{JobState::failed, 2}, {JobState::cancelled, 1}}));
}

TEST_F(SubmitTest, RejectsAWholeBatchAboveTheLimit) {
  BatchSubmission batch;
  batch.jobs.resize(4);
  EXPECT_EQ(queue.submission.submit_batch(std::move(batch)).error().reason, Rejection::Reason::owner_queued_jobs);
  EXPECT_EQ(store.count(JobState::queued), 0);
}

TEST_F(SubmitTest, DoesNotSyncJobsThatAreNotDurable) {
  Submission waited_for = submission();
  waited_for.durable = false;
  EXPECT_TRUE(queue.submission.submit(waited_for));
  run_one("a");
  EXPECT_TRUE(queue.submission.submit(submission()));
  run_one("b");
  waited_for.idempotency = Idempotency{"POST /v1/render", "key", "sha"};
  waited_for.write_reply = [](const JobView&, bool) { return FirstReply{}; };
  EXPECT_TRUE(queue.submission.submit(waited_for));  // a client with a key may send the request again
  run_one("c");
  EXPECT_EQ(durable_writes, (std::vector<bool>{false, false, true, true, true, true}));
  EXPECT_EQ(probes, 0);
}

TEST_F(SubmitTest, MakesAJobDurableOnRequest) {
  Submission waited_for = submission();
  waited_for.durable = false;
  const std::string id = queue.submission.submit(waited_for)->view.job.id;
  for (int i = 0; i < 2; ++i) queue.submission.make_durable(id);
  EXPECT_EQ(probes, 1) << "a durable job needs no probe";
  run_one("a");
  EXPECT_EQ(durable_writes, (std::vector<bool>{false, true}));
  queue.submission.make_durable("unknown");
  EXPECT_EQ(probes, 1);
}

TEST_F(SubmitTest, ADurableHitSyncsImagesThatWereNotDurable) {
  Submission first = submission("key");
  first.durable = false;
  EXPECT_TRUE(queue.submission.submit(first));
  run_one("abc");
  EXPECT_FALSE(store.find_by_content_key("key", now)->artifacts_synced);
  EXPECT_TRUE(queue.submission.submit(submission("key"))->from_cache);
  EXPECT_TRUE(store.find_by_content_key("key", now)->artifacts_synced);
}

TEST_F(SubmitTest, AnImageOfAnotherSizeThanItsRowDoesNotExist) {
  Queue files_only{stores, temporary.large_artifacts, ids, clock, no_log(), queue_settings};
  ASSERT_TRUE(files_only.submission.submit(submission("key")));
  const Claim claim = files_only.lifecycle.claim().value();
  const MemoryFile file("abc");
  files_only.lifecycle.succeed(claim.job.id, claim.fence, "{}", {{"image.png", "image/png", file.fd()}});
  const Artifact image = files_only.queries.find(claim.job.id)->job.artifacts.at(0);
  std::filesystem::resize_file(temporary.directory.path() + "/" + asset_path(image.sha256), 2);
  EXPECT_EQ(files_only.queries.open(image), nullptr);
  EXPECT_FALSE(files_only.submission.submit(submission("key"))->from_cache);
}

TEST_F(SubmitTest, SharesTheResultOfAnEqualJobThatRuns) {
  const auto submit = [&](const std::string& key) { return queue.submission.submit(submission(key))->view.job.id; };
  const auto job = [&](const std::string& id) { return queue.queries.find(id)->job; };
  const std::string first = submit("k");
  const auto claim = queue.lifecycle.claim();
  ASSERT_EQ(claim.value().job.id, first);
  const std::string second = submit("k"), third = submit("k"), fourth = submit("k");
  EXPECT_FALSE(queue.lifecycle.claim()) << "no worker is needed for the others";
  EXPECT_EQ(job(second).state, JobState::running);
  EXPECT_EQ(queue.lifecycle.cancel(fourth), CancelOutcome::cancelling);
  EXPECT_EQ(job(fourth).state, JobState::cancelled) << "at once, and alone";
  succeed(*claim, "image");
  for (const std::string& id : {second, third}) {
    EXPECT_EQ(job(id).state, JobState::succeeded);
    EXPECT_EQ(job(id).artifacts.at(0).sha256, job(first).artifacts.at(0).sha256);
    EXPECT_EQ(job(id).attempt, 0) << "not rendered";
  }
  EXPECT_EQ(job(fourth).state, JobState::cancelled);
}

TEST_F(SubmitTest, RunsAFollowerIfTheJobBeforeItFails) {
  const auto submit = [&] { return queue.submission.submit(submission("k"))->view.job.id; };
  submit();
  const auto first = queue.lifecycle.claim();
  const std::string second = submit(), third = submit();
  EXPECT_FALSE(queue.lifecycle.claim());
  queue.lifecycle.fail(first->job.id, first->fence, {"worker_crashed", "", {}});
  EXPECT_EQ(state(second), JobState::queued);
  const auto next = queue.lifecycle.claim();
  ASSERT_TRUE(next);
  EXPECT_EQ(next->job.id, second);
  EXPECT_EQ(next->job.attempt, 1) << "the time as a follower is no attempt";
  EXPECT_FALSE(queue.lifecycle.claim());
  EXPECT_TRUE(queue.lifecycle.release(second, next->fence, {}));
  EXPECT_EQ(state(third), JobState::queued);
  EXPECT_EQ(queue.lifecycle.claim().value().job.id, second);
}

TEST_F(SubmitTest, RendersARefreshOrAJobWithADeadlineBesideAnEqualOne) {
  EXPECT_TRUE(queue.submission.submit(submission("k")));
  EXPECT_TRUE(queue.lifecycle.claim());
  Submission refresh = submission("k"), hurried = submission("k");
  refresh.job.cache = api::CacheUse::refresh;
  hurried.job.deadline = now + 60'000;
  EXPECT_TRUE(queue.submission.submit(std::move(refresh)));
  EXPECT_TRUE(queue.lifecycle.claim());
  EXPECT_TRUE(queue.submission.submit(std::move(hurried)));
  EXPECT_TRUE(queue.lifecycle.claim());
}
