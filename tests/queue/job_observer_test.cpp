/// Notifications of the observer of the queue.

#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "tests/queue/queue_fixture.h"

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

class QueueObserverTest : public QueueFixture {
 protected:
  RecordingObserver observer;
};

TEST_F(QueueObserverTest, ReportsEveryTransition) {
  queue.notifications.observe(&observer);
  Claim claim = submit_and_claim();
  queue.lifecycle.set_progress(claim.job.id, 0.5);
  queue.lifecycle.release(claim.job.id, claim.fence, {});
  claim = *queue.lifecycle.claim();
  EXPECT_TRUE(succeed(claim, "image"));
  queue.lifecycle.remove(claim.job.id);
  queue.lifecycle.cancel(submit());
  claim = submit_and_claim();
  queue.lifecycle.fail(claim.job.id, claim.fence, {"internal", "", {}});
  EXPECT_EQ(observer.calls,
            "queued running 0.500000 queued running succeeded settled removed queued cancelled settled queued running "
            "failed settled ");
}

TEST_F(QueueObserverTest, CallsEveryObserver) {
  RecordingObserver other;
  for (RecordingObserver* const each : {&observer, &other}) queue.notifications.observe(each);
  queue.lifecycle.remove(submit());
  EXPECT_EQ(observer.calls, "queued removed ");
  EXPECT_EQ(other.calls, observer.calls);
}

TEST_F(QueueObserverTest, CallsWaitersBetweenTheTwoNotificationsOfAnEnd) {
  queue.notifications.observe(&observer);
  queue.waiters.when_ended(submit(), [&] { observer.calls += "waiter "; });
  EXPECT_TRUE(succeed(*queue.lifecycle.claim(), "image"));
  EXPECT_EQ(observer.calls, "queued running succeeded waiter settled ");
}

/// Calls `between` after each change of the stores, before the queue has its result.
class InterruptedQueueTest : public QueueObserverTest {
 protected:
  std::function<void()>& between = hooks.after;
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
  const Claim claim = submit_and_claim();
  queue.lifecycle.cancel(claim.job.id);
  queue.notifications.observe(&observer);
  EXPECT_TRUE(queue.lifecycle.release(claim.job.id, claim.fence, {}));
  EXPECT_EQ(observer.calls, "cancelled settled ");
}

TEST_F(QueueObserverTest, ReportsNothingForRejectedCalls) {
  const Claim claim = submit_and_claim();
  queue.notifications.observe(&observer);
  EXPECT_FALSE(queue.lifecycle.fail(claim.job.id, claim.fence + 1, {"internal", "", {}}));
  EXPECT_FALSE(queue.lifecycle.finish_cancel(claim.job.id, claim.fence + 1));
  queue.lifecycle.remove(claim.job.id);  // it runs
  queue.lifecycle.cancel("nobody");
  queue.lifecycle.set_progress("nobody", 0.5);
  EXPECT_EQ(observer.calls, "");
}

}  // namespace
