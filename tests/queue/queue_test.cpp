/// Submission, life cycle and waiters of the queue.

#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <thread>

#include "tests/queue/queue_fixture.h"
#include "tests/support/threads.h"

using namespace queue;

namespace {

/// Records its calls, and whether the job was stored before.
class RecordingListener final : public CompletionListener {
 public:
  explicit RecordingListener(TestStore& jobs) : store(jobs) {}
  void register_webhook(const std::string& id, const api::Webhook& webhook) override {
    calls.push_back("expect " + webhook.url + (store.find(id) ? ", stored" : ""));
    if (failing) throw StoreFailure(StoreFailure::Kind::full, "disk full");
  }
  void on_ended(const std::string& id) noexcept override { calls.push_back("ended " + id); }
  TestStore& store;
  std::vector<std::string> calls;
  bool failing = false;
};

class QueueTest : public QueueFixture {
 protected:
  QueueTest() : QueueFixture({.queued_limit = 10}) { queue.runner.attach(&runner); }

  RecordingRunner runner;
};

}  // namespace

TEST_F(QueueTest, RequestsAPreviewOnceAndDropsItWhenTheJobWaitsAgain) {
  const std::string id = submit();
  const auto claim = queue.lifecycle.claim();
  int called = 0;
  for (int i = 0; i < 2; ++i) queue.waiters.request_preview(id, 64, [&] { ++called; });
  queue.waiters.cancel(queue.waiters.request_preview(id, 64, [] { ADD_FAILURE() << "cancelled"; }));
  EXPECT_EQ(runner.preview_requests, std::vector<std::string>{id + " 64"});
  queue.waiters.add_preview(id, 64, "image");
  EXPECT_EQ(called, 2);
  EXPECT_EQ(*queue.waiters.preview(id, 64).png, "image");
  queue.waiters.request_preview(id, 64, [&] { ++called; });
  EXPECT_TRUE(queue.lifecycle.release(id, claim->fence, {}));
  EXPECT_EQ(called, 3);
  EXPECT_EQ(queue.waiters.preview(id, 64).png, nullptr);
  queue.waiters.add_preview(id, 64, "late");
  EXPECT_EQ(queue.waiters.preview(id, 64).png, nullptr);
}

TEST(ThroughputEstimate, IsTheMedianOfTheLatestJobsWeightedByTheirWork) {
  ThroughputEstimate throughput;
  EXPECT_EQ(throughput.seconds_per_work(), std::nullopt);
  for (const double seconds : {1.0, 3.0, 900.0}) throughput.add(seconds, 1000, 1);
  EXPECT_DOUBLE_EQ(*throughput.seconds_per_work(), 3.0 / 1000);
  for (std::size_t i = 0; i < ThroughputEstimate::jobs_max; ++i) throughput.add(14, 1000, 2);
  EXPECT_DOUBLE_EQ(*throughput.seconds_per_work(), 7.0 / 1000) << "two shared the machine; older jobs are dropped";
  throughput.add(100, 100'000, 1);
  EXPECT_DOUBLE_EQ(*throughput.seconds_per_work(), 1.0 / 1000) << "small jobs weigh little";
}

TEST_F(QueueTest, EstimatesTimesByTheWorkOfTheJobs) {
  const auto submit_work = [&](double work, int priority) {
    return submit_job("{}", [&](Job& job) { job.work = work_of(work), job.priority = priority; });
  };
  submit_work(1000, 50);
  const auto first = queue.lifecycle.claim();
  const std::string large = submit_work(1'000'000, 90), last = submit_work(500, 10);
  EXPECT_EQ(queue.queries.state().eta_s, std::nullopt) << "the speed is unknown";
  EXPECT_EQ(find(large).waiting_eta_s, std::nullopt);
  now += 100;
  succeed(*first, "image");
  EXPECT_DOUBLE_EQ(queue.queries.state().eta_s.value(), 100.05) << "1000 units of work took 0.1 s";
  EXPECT_DOUBLE_EQ(find(large).waiting_eta_s.value(), 100);
  EXPECT_DOUBLE_EQ(find(last).waiting_eta_s.value(), 100.05);
  queue.lifecycle.claim();
  queue.lifecycle.set_progress(large, 0.75);
  EXPECT_DOUBLE_EQ(find(last).waiting_eta_s.value(), 25.05);
  EXPECT_EQ(find(large).waiting_eta_s, std::nullopt);
  now += 300'000;
  EXPECT_DOUBLE_EQ(queue.queries.state().eta_s.value(), 100) << "until the running job ends";
  Queue restarted(stores, temporary.artifacts, ids, clock, no_log(), {});
  EXPECT_DOUBLE_EQ(restarted.queries.seconds_per_work().value(), 1e-4) << "of the jobs in the store";
}

TEST_F(QueueTest, StoresTheJobFieldsOfTheDocument) {
  const api::Webhook webhook{"https://example.org/", {"failed"}};
  const api::JobRequest request = {
      "orbit 7", {{"batch", "orbit"}}, 80, 5, 1'700'000'060'000, 1'700'000'120'000, 3600, {}, true, webhook};
  Job wanted;
  static_cast<api::JobRequest&>(wanted) = request;
  std::tie(wanted.kind, wanted.width, wanted.height, wanted.large) = std::tuple(JobKind::measure, 320, 200, true);
  std::tie(wanted.owner, wanted.weight, wanted.accuracy) = std::tuple("ann", 7, "{}");
  wanted.assets = {std::string(64, 'a')};
  Job expected = wanted;
  expected.id = queue.submission.submit({.document = "verbatim", .job = wanted})->view.job.id;
  expected.not_before = wanted.run_after;
  expected.created_at = 1'700'000'000'000;
  EXPECT_EQ(find(expected.id).job, expected);
  EXPECT_EQ(store.document(expected.id), "verbatim");
  EXPECT_EQ(runner.notifications, 0) << "maintenance notifies the runner when the job is due";
}

TEST_F(QueueTest, RegistersAWebhookBeforeItsJobIsStored) {
  RecordingListener listener(store);
  queue.notifications.set_completion_listener(&listener);
  Job request;
  request.webhook = api::Webhook{"http://a/"};
  const std::string first = queue.submission.submit({.document = "{}", .job = request})->view.job.id, second = submit();
  succeed(*queue.lifecycle.claim(), "image");
  queue.lifecycle.cancel(second);
  EXPECT_EQ(listener.calls, (std::vector<std::string>{"expect http://a/", "ended " + first, "ended " + second}));
  listener.failing = true;
  EXPECT_THROW((void)queue.submission.submit({.document = "{}", .job = request}), StoreFailure);
  EXPECT_EQ(store.count(JobState::queued), 0) << "its end would not be reported";
  queue.notifications.set_completion_listener(nullptr);
  EXPECT_TRUE(queue.submission.submit({.document = "{}", .job = request}));
}

TEST_F(QueueTest, RejectsAndDoesNotStoreJobsAboveTheLimit) {
  for (int i = 0; i < 10; ++i) submit();
  const auto refused = queue.submission.submit({.document = "{}"});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Rejection::Reason::queue_full);
  EXPECT_EQ(refused.error().limit, 10);
  EXPECT_EQ(refused.error().value, 10);
  EXPECT_EQ(store.count(JobState::queued), 10);
  queue.lifecycle.claim();
  EXPECT_TRUE(queue.submission.submit({.document = "{}"})) << "a running job does not wait";
}

TEST_F(QueueTest, ConcurrentSubmissionsDoNotExceedTheLimit) {
  std::atomic<int> accepted = 0;
  in_threads(8, [&](int) {
    for (int i = 0; i < 10; ++i) accepted += queue.submission.submit({.document = "{}"}).has_value() ? 1 : 0;
  });
  EXPECT_EQ(accepted, 10);
  EXPECT_EQ(store.count(JobState::queued), 10);
}

TEST_F(QueueTest, AFailedSubmitDoesNotCountAgainstTheLimit) {
  hooks.failing = "insert";
  for (int i = 0; i < 20; ++i) EXPECT_THROW(submit(), StoreFailure);
  hooks.failing.clear();
  EXPECT_TRUE(queue.submission.submit({.document = "{}"}));
  EXPECT_EQ(store.count(JobState::queued), 1);
}

TEST_F(QueueTest, ProgressGrowsWhileAJobRunsAndIsOneWhenItSucceeded) {
  const std::string id = submit();
  EXPECT_EQ(find(id).progress, 0);
  queue.lifecycle.set_progress(id, 0.9);
  EXPECT_EQ(find(id).progress, 0) << "it does not run";
  const Claim claim = *queue.lifecycle.claim();
  queue.lifecycle.set_progress(id, 0.5);
  queue.lifecycle.set_progress(id, 0.25);
  EXPECT_EQ(find(id).progress, 0.5);
  queue.lifecycle.set_progress(id, 7);
  EXPECT_EQ(queue.queries.progress(id), 1);
  queue.lifecycle.release(id, claim.fence, {.counts = true});
  EXPECT_EQ(find(id).progress, 0);
  const Claim second = *queue.lifecycle.claim();
  EXPECT_EQ(find(id).progress, 0);
  EXPECT_TRUE(succeed(second, "abc"));
  EXPECT_EQ(find(id).progress, 1);
}

TEST_F(QueueTest, CancellingNotifiesTheRunnerOfARunningJobOnly) {
  EXPECT_EQ(queue.lifecycle.cancel(submit()), CancelOutcome::cancelled);
  EXPECT_TRUE(runner.cancelled.empty());
  const std::string id = submit();
  const Claim claim = *queue.lifecycle.claim();
  EXPECT_EQ(queue.lifecycle.cancel(id), CancelOutcome::cancelling);
  EXPECT_EQ(runner.cancelled, std::vector<std::string>{id});
  EXPECT_TRUE(find(id).job.cancel_requested);
  EXPECT_TRUE(queue.lifecycle.finish_cancel(id, claim.fence));
  EXPECT_EQ(find(id).job.state, JobState::cancelled);
}

TEST_F(QueueTest, CallsAWaiterOnceForEveryWayAJobEnds) {
  const std::vector<std::pair<std::string, std::function<void(const std::string&)>>> ends = {
      {"succeed", [&](auto&) { succeed(*queue.lifecycle.claim(), "abc"); }},
      {"fail",
       [&](auto& id) {
         queue.lifecycle.fail(id, queue.lifecycle.claim()->fence, {"internal", "x", {}});
       }},
      {"cancel queued", [&](auto& id) { queue.lifecycle.cancel(id); }},
      {"finish_cancel", [&](auto& id) { queue.lifecycle.finish_cancel(id, queue.lifecycle.claim()->fence); }},
      {"release of a cancelled one",
       [&](auto& id) {
         const Claim claim = *queue.lifecycle.claim();
         queue.lifecycle.cancel(id);
         queue.lifecycle.release(id, claim.fence, {});
       }},
      {"end of the lease of a cancelled one",
       [&](auto& id) {
         queue.lifecycle.claim();
         queue.lifecycle.cancel(id);
         now += queue_settings.lease_ms;
         queue.lifecycle.run_maintenance();
       }},
      {"remove", [&](auto& id) { queue.lifecycle.remove(id); }},  // later waiters are those of an unknown job
  };
  for (const auto& [name, end] : ends) {
    const std::string id = submit();
    int early = 0, late = 0;
    queue.waiters.when_ended(id, [&] { ++early; });
    queue.lifecycle.release(id, queue.lifecycle.claim()->fence, {.counts = true});
    EXPECT_EQ(early, 0) << name << ": it goes back to the queue";
    end(id);
    EXPECT_EQ(early, 1) << name;
    queue.waiters.when_ended(id, [&] { ++late; });
    EXPECT_EQ(late, 1) << name << ": a late waiter is called at once";
    queue.lifecycle.remove(id);
    EXPECT_EQ(early, 1) << name;
  }
}

TEST_F(QueueTest, CallsAllWaitersExceptCancelledOnes) {
  const std::string id = submit();
  std::set<int> called;
  queue.waiters.when_ended(id, [&] { called.insert(1); });
  const Previews::Token forgotten = queue.waiters.when_ended(id, [&] { called.insert(2); });
  queue.waiters.when_ended(id, [&] { called.insert(3); });
  queue.waiters.when_ended(submit(), [&] { called.insert(4); });
  queue.waiters.cancel(forgotten);
  queue.waiters.cancel(forgotten);
  queue.lifecycle.cancel(id);
  EXPECT_EQ(called, (std::set<int>{1, 3}));
}

TEST_F(QueueTest, CallsAWaiterOnceWhenTheJobEndsAtTheSameTime) {
  for (int round = 0; round < 200; ++round) {
    const std::string id = submit();
    std::atomic<int> calls = 0;
    std::thread ender([&] { queue.lifecycle.cancel(id); });
    queue.waiters.when_ended(id, [&] { ++calls; });
    ender.join();
    EXPECT_EQ(calls, 1);
  }
}

TEST_F(QueueTest, ReportsTheReasonOfNotBeingReady) {
  EXPECT_EQ(queue.queries.not_ready(), "");
  runner.status = "worker: restarting";
  EXPECT_EQ(queue.queries.not_ready(), "worker: restarting");
  hooks.failing = "probe";
  EXPECT_EQ(queue.queries.not_ready(), "store: disk full");
  hooks.failing.clear();
  queue.runner.attach(nullptr);
  EXPECT_EQ(queue.queries.not_ready(), "worker: not started");
}
