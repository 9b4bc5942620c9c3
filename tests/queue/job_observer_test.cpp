/// What the queue tells of what happens to jobs.

#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "server/queue/queue.h"
#include "server/storage/memory/memory_artifact_store.h"
#include "server/storage/memory/memory_job_store.h"
#include "tests/conformance/memory_file.h"

using namespace queue;

namespace {

class RecordingObserver final : public Observer {
 public:
  void on_state_changed(const std::string&, JobState to) noexcept override { told += std::string(name_of(to)) + ' '; }
  void progressed(const std::string&, double fraction) noexcept override { told += std::to_string(fraction) + ' '; }
  void removed(const std::string&) noexcept override { told += "removed "; }
  void on_waiters_notified(const std::string&) noexcept override { told += "settled "; }
  std::string told;
};

class QueueObserverTest : public testing::Test {
 protected:
  std::string submit() { return queue.submit({.document = "{}"})->view.job.id; }
  bool succeed(const Claim& claim, const std::string& image) {
    const MemoryFile file(image);
    return queue.succeed(claim.job.id, claim.fence, "{}", {{"image.png", "image/png", file.fd()}});
  }

  MemoryJobStore store;
  MemoryArtifactStore artifacts;
  IdSource ids{system_clock(), system_random()};
  Queue queue{store, artifacts, ids, system_clock(), no_log(), {}};
  RecordingObserver observer;
};

TEST_F(QueueObserverTest, TellsEveryMoveToItsObserver) {
  queue.observe(&observer);
  submit();
  Claim claim = *queue.claim(false);
  queue.progressed(claim.job.id, 0.5);
  queue.release(claim.job.id, claim.fence, false, false);
  claim = *queue.claim(false);
  EXPECT_TRUE(succeed(claim, "image"));
  queue.remove(claim.job.id);
  queue.cancel(submit());
  submit();
  claim = *queue.claim(false);
  queue.fail(claim.job.id, claim.fence, {"internal", "", {}});
  EXPECT_EQ(observer.told,
            "queued running 0.500000 queued running succeeded settled removed queued cancelled settled queued running "
            "failed settled ");
}

TEST_F(QueueObserverTest, WhoWaitsForAnEndIsCalledBetweenItsNewsAndTheTimeForWhatTakesLonger) {
  queue.observe(&observer);
  queue.when_ended(submit(), [&] { observer.told += "waiter "; });
  EXPECT_TRUE(succeed(*queue.claim(false), "image"));
  EXPECT_EQ(observer.told, "queued running succeeded waiter settled ");
}

/// A store whose admit, and release, returns only after another thread has claimed the job.
class LateStore : public MemoryJobStore {
 public:
  std::optional<KeptReply> insert_job(const InsertRequest& admission, std::int64_t now) override {
    auto earlier = MemoryJobStore::insert_job(admission, now);
    between();
    return earlier;
  }
  bool release(const std::string& id, std::int64_t fence, std::int64_t now, const Release& how) override {
    const bool on_state_changed = MemoryJobStore::release(id, fence, now, how);
    between();
    return on_state_changed;
  }
  std::function<void()> between = [] {};
};

TEST(QueueObserver, NobodyHearsThatAJobRunsBeforeHearingThatItWaits) {
  LateStore store;
  MemoryArtifactStore artifacts;
  IdSource ids(system_clock(), system_random());
  Queue queue(store, artifacts, ids, system_clock(), no_log(), {});
  RecordingObserver observer;
  queue.observe(&observer);
  std::optional<Claim> claim;
  store.between = [&] { std::jthread([&] { claim = queue.claim(false); }); };
  ASSERT_TRUE(queue.submit({.document = "{}"}));
  ASSERT_TRUE(claim);
  EXPECT_EQ(observer.told, "queued running ");
  const Claim first = *claim;
  EXPECT_TRUE(queue.release(first.job.id, first.fence, false, false));
  EXPECT_EQ(observer.told, "queued running queued running ");
}

TEST_F(QueueObserverTest, TellsOfACancelThatAReleaseCarriesOut) {
  submit();
  const Claim claim = *queue.claim(false);
  queue.cancel(claim.job.id);
  queue.observe(&observer);
  EXPECT_TRUE(queue.release(claim.job.id, claim.fence, false, false));
  EXPECT_EQ(observer.told, "cancelled settled ");
}

TEST_F(QueueObserverTest, TellsNothingThatDidNotHappen) {
  submit();
  const Claim claim = *queue.claim(false);
  queue.observe(&observer);
  EXPECT_FALSE(queue.fail(claim.job.id, claim.fence + 1, {"internal", "", {}}));
  EXPECT_FALSE(queue.finish_cancel(claim.job.id, claim.fence + 1));
  queue.remove(claim.job.id);  // it runs
  queue.cancel("nobody");
  queue.progressed("nobody", 0.5);
  EXPECT_EQ(observer.told, "");
}

}  // namespace
