/// The queue over stores in memory.

#include "server/queue/queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <set>
#include <thread>

#include "server/storage/memory/memory_artifact_store.h"
#include "server/storage/memory/memory_job_store.h"
#include "tests/conformance/memory_file.h"

using namespace queue;

namespace {

class RecordingRunner final : public JobRunner {
 public:
  void wake(bool) noexcept override { ++wakes; }
  void cancel(const std::string& id) noexcept override { cancelled.push_back(id); }
  void look(const std::string& id, std::uint32_t side) noexcept override {
    looked.push_back(id + " " + std::to_string(side));
  }
  void lost(const Lease& lease) noexcept override { lost_leases.push_back(lease); }
  std::string not_ready() override { return status; }
  int wakes = 0;
  std::vector<std::string> cancelled, looked;
  std::vector<Lease> lost_leases;
  std::string status;
};

/// Notes what it hears, and whether the job was stored already.
class RecordingListener final : public CompletionListener {
 public:
  explicit RecordingListener(JobStore& jobs) : store(jobs) {}
  void expect(const std::string& id, const api::Webhook& webhook) override {
    heard.push_back("expect " + webhook.url + (store.find(id) ? ", stored" : ""));
    if (failing) throw StoreFailure(StoreFailure::Kind::full, "disk full");
  }
  void ended(const std::string& id) noexcept override { heard.push_back("ended " + id); }
  JobStore& store;
  std::vector<std::string> heard;
  bool failing = false;
};

/// A store that can be told to fail.
class FailingStore : public MemoryJobStore {
 public:
  std::optional<KeptReply> insert_job(const InsertRequest& admission, std::int64_t now) override {
    fail_if_told();
    return MemoryJobStore::insert_job(admission, now);
  }
  bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
               const std::vector<Artifact>& artifacts, bool durable, const std::vector<SmallImage>& small) override {
    fail_if_told();
    return MemoryJobStore::succeed(id, fence, now, report, artifacts, durable, small);
  }
  void probe() override { fail_if_told(); }
  std::atomic<bool> failing = false;

 private:
  void fail_if_told() {
    if (failing) throw StoreFailure(StoreFailure::Kind::full, "disk full");
  }
};

class QueueTest : public testing::Test {
 protected:
  QueueTest() { queue.attach(&runner); }

  std::string submit(const std::string& name = "", const std::string& document = "{}") {
    Submission submission;
    submission.document = document;
    submission.parsed.job.name = name;
    return queue.submit(std::move(submission))->view.job.id;
  }
  bool succeed(const Claim& claim, const std::string& image) {
    const MemoryFile file(image);
    return queue.succeed(claim.job.id, claim.fence, "{}", {{"image.png", "image/png", file.fd()}});
  }
  JobView find(const std::string& id) { return queue.find(id).value(); }

  std::atomic<std::int64_t> now = 1'700'000'000'000;
  FailingStore store;
  MemoryArtifactStore artifacts;
  IdSource ids{[this] { return now.load(); }, system_random()};
  RecordingRunner runner;
  Queue queue{store, artifacts, ids, [this] { return now.load(); }, no_log(), QueueSettings{.queued_limit = 10}};
};

}  // namespace

TEST_F(QueueTest, OneLookIsEnoughForAllWhoWaitAndNothingIsKeptOfJobsThatDoNotRun) {
  const std::string id = submit();
  const auto claim = queue.claim(false);
  int told = 0;
  for (int i = 0; i < 2; ++i) queue.look(id, 64, [&] { ++told; });
  const std::uint64_t token = queue.look(id, 64, [&] { ADD_FAILURE() << "stopped looking"; });
  queue.cancel_preview(token);
  EXPECT_EQ(runner.looked, std::vector<std::string>{id + " 64"});
  queue.previewed(id, 64, "image");
  EXPECT_EQ(told, 2);
  EXPECT_EQ(*queue.preview(id, 64).png, "image");
  queue.look(id, 64, [&] { ++told; });
  EXPECT_TRUE(queue.release(id, claim->fence, false, false));
  EXPECT_EQ(told, 3) << "it waits again";
  EXPECT_EQ(queue.preview(id, 64).png, nullptr);
  queue.previewed(id, 64, "late");
  EXPECT_EQ(queue.preview(id, 64).png, nullptr);
}

TEST_F(QueueTest, ASubmittedJobCarriesWhatTheDocumentAskedFor) {
  api::Document parsed;
  const api::Webhook webhook{"https://example.org/", {"failed"}};
  parsed.job = {"orbit 7", {{"batch", "orbit"}}, 80, 5, 1'700'000'060'000, 1'700'000'120'000, 3600, {}, webhook};
  parsed.scene.image = {320, 200};
  parsed.scene.assets = {{"tile.png", ""}, {"sha256:" + std::string(64, 'a'), ""}};
  const JobView view =
      queue
          .submit(
              {.kind = JobKind::measure, .document = "verbatim", .parsed = parsed, .accuracy = "{}", .owner = "ann"})
          ->view;
  const Job job = find(view.job.id).job;
  EXPECT_EQ(job.name, "orbit 7");
  EXPECT_EQ(job.labels.at("batch"), "orbit");
  EXPECT_EQ(job.priority, 80);
  EXPECT_EQ(job.max_attempts, 5);
  EXPECT_EQ(job.owner, "ann");
  EXPECT_EQ(job.kind, JobKind::measure);
  EXPECT_EQ(job.accuracy, "{}");
  EXPECT_EQ(job.run_after, 1'700'000'060'000);
  EXPECT_EQ(job.not_before, 1'700'000'060'000);
  EXPECT_EQ(job.deadline, 1'700'000'120'000);
  EXPECT_EQ(job.expires_in_s, 3600);
  EXPECT_EQ(job.webhook, webhook);
  EXPECT_EQ(job.width, 320u);
  EXPECT_EQ(job.assets, std::vector{std::string(64, 'a')}) << "uploads alone";
  EXPECT_EQ(job.height, 200u);
  EXPECT_EQ(job.created_at, 1'700'000'000'000);
  EXPECT_EQ(job.state, JobState::queued);
  EXPECT_EQ(store.document(job.id), "verbatim");
  EXPECT_EQ(runner.wakes, 1);
}

TEST_F(QueueTest, AWebhookIsExpectedBeforeItsJobIsStoredAndEveryEndIsTold) {
  RecordingListener listener(store);
  queue.set_completion_listener(&listener);
  api::Document parsed;
  parsed.job.webhook = api::Webhook{"http://a/"};
  const std::string first = queue.submit({.document = "{}", .parsed = parsed})->view.job.id, second = submit();
  succeed(*queue.claim(false), "image");
  queue.cancel(second);
  EXPECT_EQ(listener.heard, (std::vector<std::string>{"expect http://a/", "ended " + first, "ended " + second}));
  listener.failing = true;
  EXPECT_THROW((void)queue.submit({.document = "{}", .parsed = parsed}), StoreFailure);
  EXPECT_EQ(store.count(JobState::queued), 0) << "nobody would be told of it";
  queue.set_completion_listener(nullptr);
  EXPECT_TRUE(queue.submit({.document = "{}", .parsed = parsed}));
}

TEST_F(QueueTest, RefusesMoreWaitingJobsThanTheLimitAndStoresNothingOfThem) {
  for (int i = 0; i < 10; ++i) submit();
  const auto refused = queue.submit({.document = "{}"});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().why, Refused::Why::queue_full);
  EXPECT_EQ(refused.error().limit, 10);
  EXPECT_EQ(refused.error().seen, 10);
  EXPECT_EQ(store.count(JobState::queued), 10);
  queue.claim(false);
  EXPECT_TRUE(queue.submit({.document = "{}"})) << "a running job does not wait";
}

TEST_F(QueueTest, ManyThreadsTogetherDoNotPassTheLimit) {
  std::atomic<int> accepted = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < 10; ++k) accepted += queue.submit({.document = "{}"}).has_value() ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(accepted, 10);
  EXPECT_EQ(store.count(JobState::queued), 10);
}

TEST_F(QueueTest, AFailedSubmitDoesNotCountAgainstTheLimit) {
  store.failing = true;
  for (int i = 0; i < 20; ++i) EXPECT_THROW(submit(), StoreFailure);
  store.failing = false;
  EXPECT_TRUE(queue.submit({.document = "{}"}));
  EXPECT_EQ(store.count(JobState::queued), 1);
}

TEST_F(QueueTest, ProgressGrowsWhileAJobRunsAndIsOneWhenItSucceeded) {
  const std::string id = submit();
  EXPECT_EQ(find(id).progress, 0);
  queue.progressed(id, 0.9);
  EXPECT_EQ(find(id).progress, 0) << "it does not run";
  const Claim claim = *queue.claim(false);
  queue.progressed(id, 0.5);
  queue.progressed(id, 0.25);
  EXPECT_EQ(find(id).progress, 0.5);
  queue.progressed(id, 7);
  EXPECT_EQ(queue.progress(id), 1);
  EXPECT_TRUE(succeed(claim, "abc"));
  EXPECT_EQ(find(id).progress, 1);
}

TEST_F(QueueTest, AReleasedJobStartsAgainAtProgressZero) {
  const std::string id = submit();
  const Claim claim = *queue.claim(false);
  queue.progressed(id, 0.5);
  queue.release(id, claim.fence, true, false);
  EXPECT_EQ(find(id).progress, 0);
  queue.claim(false);
  EXPECT_EQ(find(id).progress, 0);
}

TEST_F(QueueTest, CancellingAQueuedJobEndsItAndTellsNobodyElse) {
  const std::string id = submit();
  EXPECT_EQ(queue.cancel(id), CancelOutcome::cancelled);
  EXPECT_EQ(find(id).job.state, JobState::cancelled);
  EXPECT_TRUE(runner.cancelled.empty());
}

TEST_F(QueueTest, CancellingARunningJobTellsTheRunner) {
  const std::string id = submit();
  const Claim claim = *queue.claim(false);
  EXPECT_EQ(queue.cancel(id), CancelOutcome::cancelling);
  EXPECT_EQ(runner.cancelled, std::vector<std::string>{id});
  EXPECT_TRUE(find(id).job.cancel_requested);
  EXPECT_TRUE(queue.finish_cancel(id, claim.fence));
  EXPECT_EQ(find(id).job.state, JobState::cancelled);
}

TEST_F(QueueTest, CancellingAFinishedOrUnknownJobChangesNothing) {
  const std::string id = submit();
  succeed(*queue.claim(false), "abc");
  EXPECT_EQ(queue.cancel(id), CancelOutcome::already_ended);
  EXPECT_EQ(find(id).job.state, JobState::succeeded);
  EXPECT_EQ(queue.cancel("nobody"), CancelOutcome::unknown);
}

TEST_F(QueueTest, CallsAWaiterOnceForEveryWayAJobEnds) {
  const std::vector<std::pair<std::string, std::function<void(const std::string&)>>> ends = {
      {"succeed", [&](auto&) { succeed(*queue.claim(false), "abc"); }},
      {"fail",
       [&](auto& id) {
         queue.fail(id, queue.claim(false)->fence, {"internal", "x", {}});
       }},
      {"cancel queued", [&](auto& id) { queue.cancel(id); }},
      {"finish_cancel", [&](auto& id) { queue.finish_cancel(id, queue.claim(false)->fence); }},
      {"release of a cancelled one",
       [&](auto& id) {
         const Claim claim = *queue.claim(false);
         queue.cancel(id);
         queue.release(id, claim.fence, false, false);
       }},
      {"remove", [&](auto& id) { queue.remove(id); }},
  };
  for (const auto& [name, end] : ends) {
    const std::string id = submit();
    int early = 0, late = 0;
    queue.when_ended(id, [&] { ++early; });
    EXPECT_EQ(early, 0) << name;
    end(id);
    EXPECT_EQ(early, 1) << name;
    queue.when_ended(id, [&] { ++late; });
    EXPECT_EQ(late, 1) << name << ": one who comes late is called at once";
    queue.remove(id);
    EXPECT_EQ(early, 1) << name;
  }
}

TEST_F(QueueTest, DoesNotCallAWaiterWhenTheJobGoesBackToTheQueue) {
  const std::string id = submit();
  int calls = 0;
  queue.when_ended(id, [&] { ++calls; });
  queue.release(id, queue.claim(false)->fence, true, false);
  EXPECT_EQ(calls, 0);
}

TEST_F(QueueTest, CallsAllWaitersButThoseThatWereForgotten) {
  const std::string id = submit();
  std::set<int> called;
  queue.when_ended(id, [&] { called.insert(1); });
  const std::uint64_t forgotten = queue.when_ended(id, [&] { called.insert(2); });
  queue.when_ended(id, [&] { called.insert(3); });
  queue.when_ended(submit(), [&] { called.insert(4); });
  queue.forget(forgotten);
  queue.forget(forgotten);
  queue.cancel(id);
  EXPECT_EQ(called, (std::set<int>{1, 3}));
}

TEST_F(QueueTest, CallsAWaiterForAnUnknownJobAtOnce) {
  int calls = 0;
  queue.when_ended("nobody", [&] { ++calls; });
  EXPECT_EQ(calls, 1);
}

TEST_F(QueueTest, WaitersAndEndsThatRaceMeetExactlyOnce) {
  for (int round = 0; round < 200; ++round) {
    const std::string id = submit();
    std::atomic<int> calls = 0;
    std::thread ender([&] { queue.cancel(id); });
    queue.when_ended(id, [&] { ++calls; });
    ender.join();
    EXPECT_EQ(calls, 1);
  }
}

TEST_F(QueueTest, AWaiterMayAskTheQueue) {
  const std::string id = submit();
  JobState seen = JobState::queued;
  queue.when_ended(id, [&] { seen = find(id).job.state; });
  queue.cancel(id);
  EXPECT_EQ(seen, JobState::cancelled);
}

TEST_F(QueueTest, SaysWhyItIsNotReady) {
  EXPECT_EQ(queue.not_ready(), "");
  runner.status = "worker: restarting";
  EXPECT_EQ(queue.not_ready(), "worker: restarting");
  store.failing = true;
  EXPECT_EQ(queue.not_ready(), "store: disk full");
  store.failing = false;
  queue.attach(nullptr);
  EXPECT_EQ(queue.not_ready(), "worker: not started");
}

TEST_F(QueueTest, ANewQueueTakesOverWhatTheDeadOneLeftRunning) {
  const std::string id = submit();
  queue.claim(false);
  Queue next(store, artifacts, ids, system_clock(), no_log(), {});
  EXPECT_EQ(next.find(id)->job.state, JobState::queued);
  EXPECT_EQ(next.find(id)->job.attempt, 0);
}
