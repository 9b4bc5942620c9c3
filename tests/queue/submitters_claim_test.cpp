/// While nothing waits and a place is free, who submits a job claims it for the worker.

#include <functional>
#include <thread>

#include "tests/queue/supervised.h"

using queue::JobState;

namespace {

/// Tells which threads claim jobs, and can hold up the one of the test.
class WatchedStore final : public queue::MemoryJobStore {
 public:
  std::optional<queue::Claim> claim(const std::string& boot, std::int64_t now, std::int64_t lease_until,
                                    bool alone) override {
    ++claims;
    auto claim = MemoryJobStore::claim(boot, now, lease_until, alone);
    if (claim && std::this_thread::get_id() == test_thread_) {
      ++own_claims;
      in_between(claim->job.id);
    }
    return claim;
  }
  std::atomic<int> claims = 0, own_claims = 0;
  std::function<void(const std::string& id)> in_between = [](const std::string&) {};

 private:
  const std::thread::id test_thread_ = std::this_thread::get_id();
};

/// On a thread of its own: the test's is in the middle of a call.
void elsewhere(const std::function<void()>& call) { std::jthread(call).join(); }

class SubmittersClaimTest : public SupervisorTest {
 protected:
  std::string submit_watched() { return watched_queue.submit({.document = "{}"})->view.job.id; }
  bool reaches_watched(const std::string& id, JobState wanted) {
    return eventually([&] { return watched_queue.find(id)->job.state == wanted; });
  }
  /// Jobs, until this thread has claimed one: the supervisor offers that when it has looked around.
  std::string submit_until_claimed_here() {
    const int before = watched.own_claims;
    std::string id;
    EXPECT_TRUE(eventually([&] {
      id = submit_watched();
      if (watched.own_claims > before) return true;
      reaches_watched(id, JobState::succeeded);
      return false;
    }));
    return id;
  }
  WatchedStore watched;
  queue::Queue watched_queue{watched, artifacts, ids, queue::system_clock(), log.log(), {}};
};

}  // namespace

TEST_F(SubmittersClaimTest, AJobThatComesAloneIsClaimedOnceAndByItsSubmitter) {
  const worker::Supervisor over(watched_queue, settings(), log.log());
  ASSERT_TRUE(reaches_watched(submit_until_claimed_here(), JobState::succeeded));
  const int claims = watched.claims, own_claims = watched.own_claims;
  int alone = 0;
  ASSERT_TRUE(eventually([&] {
    const int claims_before = watched.claims, own_before = watched.own_claims;
    EXPECT_TRUE(reaches_watched(submit_watched(), JobState::succeeded));
    alone += watched.claims == claims_before + 1 && watched.own_claims == own_before + 1 ? 1 : 0;
    return alone == 20;
  })) << watched.claims - claims
      << " claims, " << watched.own_claims - own_claims << " by the submitter";
}

TEST_F(SubmittersClaimTest, AllJobsOfManySubmittersAtOnceRunOnce) {
  const worker::Supervisor over(watched_queue, settings(4), log.log());
  std::vector<std::jthread> submitters;
  for (int thread = 0; thread < 8; ++thread) {
    submitters.emplace_back([&] {
      for (int i = 0; i < 50; ++i) {
        const std::string id = submit_watched();
        if (i % 5 == 0) reaches_watched(id, JobState::succeeded);
      }
    });
  }
  submitters.clear();
  EXPECT_TRUE(eventually([&] { return watched.count(JobState::succeeded) == 400; }));
  for (const queue::Job& job : watched_queue.list({}, "", 1000).items) EXPECT_EQ(job.attempt, 1);
}

TEST_F(SubmittersClaimTest, AJobCancelledWhileItsSubmitterClaimsItDoesNotRun) {
  const worker::Supervisor over(watched_queue, settings(), log.log());
  watched.in_between = [&](const std::string& id) { elsewhere([&] { watched_queue.cancel(id); }); };
  const std::string id = submit_until_claimed_here();
  EXPECT_TRUE(reaches_watched(id, JobState::cancelled));
  watched.in_between = [](const std::string&) {};
  EXPECT_TRUE(reaches_watched(submit_watched(), JobState::succeeded));
}

TEST_F(SubmittersClaimTest, ADrainGivesBackWhatASubmitterClaimsMeanwhile) {
  worker::Supervisor over(watched_queue, settings(), log.log());
  std::jthread drain;
  watched.in_between = [&](const std::string&) {
    drain = std::jthread([&] { over.drain(std::chrono::seconds(30)); });
    elsewhere([&] { EXPECT_TRUE(eventually([&] { return watched_queue.not_ready() == "draining"; })); });
  };
  const std::string id = submit_until_claimed_here();
  drain.join();
  EXPECT_EQ(watched_queue.find(id)->job.state, JobState::queued);
  EXPECT_EQ(watched_queue.find(id)->job.attempt, 0);
}
