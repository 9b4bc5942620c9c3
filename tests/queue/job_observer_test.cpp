/// Notifications of the observer of the queue.

#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "server/queue/queue.h"
#include "tests/conformance/memory_file.h"
#include "tests/conformance/temporary_stores.h"

using namespace queue;

namespace {

class RecordingObserver final : public JobObserver {
 public:
  void on_state_changed(const std::string&, JobState to) noexcept override { calls += std::string(name_of(to)) + ' '; }
  void on_progress(const std::string&, double fraction) noexcept override { calls += std::to_string(fraction) + ' '; }
  void on_removed(const JobSummary&) noexcept override { calls += "removed "; }
  void on_waiters_notified(const EndedJob&) noexcept override { calls += "settled "; }
  std::string calls;
};

class QueueObserverTest : public testing::Test {
 protected:
  std::string submit() { return queue.submission.submit({.document = "{}"})->view.job.id; }
  bool succeed(const Claim& claim, const std::string& image) {
    const MemoryFile file(image);
    return queue.lifecycle.succeed(claim.job.id, claim.fence, "{}", {{"image.png", "image/png", file.fd()}});
  }

  TemporaryStores temporary;
  TestStore& store = temporary.store;
  IdSource ids{system_clock(), system_random()};
  Queue queue{store.all(), temporary.artifacts, ids, system_clock(), no_log(), {}};
  RecordingObserver observer;
};

TEST_F(QueueObserverTest, ReportsEveryTransition) {
  queue.notifications.observe(&observer);
  submit();
  Claim claim = *queue.lifecycle.claim();
  queue.lifecycle.set_progress(claim.job.id, 0.5);
  queue.lifecycle.release(claim.job.id, claim.fence, {});
  claim = *queue.lifecycle.claim();
  EXPECT_TRUE(succeed(claim, "image"));
  queue.lifecycle.remove(claim.job.id);
  queue.lifecycle.cancel(submit());
  submit();
  claim = *queue.lifecycle.claim();
  queue.lifecycle.fail(claim.job.id, claim.fence, {"internal", "", {}});
  EXPECT_EQ(observer.calls,
            "queued running 0.500000 queued running succeeded settled removed queued cancelled settled queued running "
            "failed settled ");
}

TEST_F(QueueObserverTest, CallsWaitersBetweenTheTwoNotificationsOfAnEnd) {
  queue.notifications.observe(&observer);
  queue.waiters.when_ended(submit(), [&] { observer.calls += "waiter "; });
  EXPECT_TRUE(succeed(*queue.lifecycle.claim(), "image"));
  EXPECT_EQ(observer.calls, "queued running succeeded waiter settled ");
}

/// Stores whose insert and release return only after `between`.
class LateJobs final : public JobStore {
 public:
  LateJobs(JobStore& target, std::function<void()>& call) : JobStore(target), between(call) {}
  InsertResult insert(const InsertRequest& request, std::int64_t now) override {
    InsertResult result = JobStore::insert(request, now);
    between();
    return result;
  }
  std::function<void()>& between;
};

class LateTransitions final : public JobTransitions {
 public:
  LateTransitions(JobTransitions& target, std::function<void()>& call) : JobTransitions(target), between(call) {}
  ReleaseOutcome release(const std::string& id, std::int64_t fence, std::int64_t now, const Release& how) override {
    const ReleaseOutcome released = JobTransitions::release(id, fence, now, how);
    between();
    return released;
  }
  std::function<void()>& between;
};

class LateMaintenance final : public MaintenanceStore {
 public:
  LateMaintenance(MaintenanceStore& target, std::function<void()>& call) : MaintenanceStore(target), between(call) {}
  MaintenanceResult run_maintenance(std::int64_t now, const Retention& retention, int limit) override {
    MaintenanceResult result = MaintenanceStore::run_maintenance(now, retention, limit);
    between();
    return result;
  }
  std::function<void()>& between;
};

/// Calls `between` after each change of the stores, before the queue has its result.
class InterruptedQueueTest : public testing::Test {
 protected:
  Claim submit_and_claim() {
    (void)queue.submission.submit({.document = "{}"});
    return queue.lifecycle.claim().value();
  }

  std::function<void()> between = [] {};
  TemporaryStores temporary;
  const Stores& all = temporary.store.all();
  LateJobs jobs{all.jobs, between};
  LateTransitions transitions{all.transitions, between};
  LateMaintenance maintenance{all.maintenance, between};
  IdSource ids{system_clock(), system_random()};
  std::atomic<std::int64_t> now = system_clock()();
  Queue queue{{jobs, all.statistics, transitions, all.batches, maintenance},
              temporary.artifacts,
              ids,
              [this] { return now.load(); },
              no_log(),
              {}};
  RecordingObserver observer;
};

TEST_F(InterruptedQueueTest, ReportsQueuedBeforeRunning) {
  queue.notifications.observe(&observer);
  std::optional<Claim> claim;
  between = [&] { std::jthread([&] { claim = queue.lifecycle.claim(); }); };
  ASSERT_TRUE(queue.submission.submit({.document = "{}"}));
  ASSERT_TRUE(claim);
  EXPECT_EQ(observer.calls, "queued running ");
  const Claim first = *claim;
  EXPECT_TRUE(queue.lifecycle.release(first.job.id, first.fence, {}));
  EXPECT_EQ(observer.calls, "queued running queued running ");
}

TEST_F(InterruptedQueueTest, ReportsNoQueuedStateOfAnAbandonedJobThatWasCancelledMeanwhile) {
  const Claim claim = submit_and_claim();
  queue.notifications.observe(&observer);
  now += 1'000'000;  // after the end of the lease
  between = [&] { EXPECT_EQ(queue.lifecycle.cancel(claim.job.id), CancelOutcome::cancelled); };
  queue.lifecycle.run_maintenance();
  EXPECT_EQ(observer.calls, "cancelled settled ");
}

TEST_F(InterruptedQueueTest, ReportsTheEndOfAReleasedJobOnce) {
  const Claim claim = submit_and_claim();
  queue.notifications.observe(&observer);
  between = [&] { EXPECT_EQ(queue.lifecycle.cancel(claim.job.id), CancelOutcome::cancelled); };
  EXPECT_TRUE(queue.lifecycle.release(claim.job.id, claim.fence, {}));
  EXPECT_EQ(observer.calls, "queued cancelled settled ");
}

TEST_F(InterruptedQueueTest, CallsTheWaitersOfAReleasedJobThatWasDeletedMeanwhile) {
  const Claim claim = submit_and_claim();
  bool called = false;
  queue.waiters.when_ended(claim.job.id, [&] { called = true; });
  queue.lifecycle.cancel(claim.job.id);
  between = [&] { temporary.store.remove(claim.job.id); };  // by another daemon
  EXPECT_TRUE(queue.lifecycle.release(claim.job.id, claim.fence, {}));
  EXPECT_TRUE(called);
}

TEST_F(QueueObserverTest, ReportsTheCancelOfAReleasedJob) {
  submit();
  const Claim claim = *queue.lifecycle.claim();
  queue.lifecycle.cancel(claim.job.id);
  queue.notifications.observe(&observer);
  EXPECT_TRUE(queue.lifecycle.release(claim.job.id, claim.fence, {}));
  EXPECT_EQ(observer.calls, "cancelled settled ");
}

TEST_F(QueueObserverTest, ReportsNothingForRejectedCalls) {
  submit();
  const Claim claim = *queue.lifecycle.claim();
  queue.notifications.observe(&observer);
  EXPECT_FALSE(queue.lifecycle.fail(claim.job.id, claim.fence + 1, {"internal", "", {}}));
  EXPECT_FALSE(queue.lifecycle.finish_cancel(claim.job.id, claim.fence + 1));
  queue.lifecycle.remove(claim.job.id);  // it runs
  queue.lifecycle.cancel("nobody");
  queue.lifecycle.set_progress("nobody", 0.5);
  EXPECT_EQ(observer.calls, "");
}

}  // namespace
