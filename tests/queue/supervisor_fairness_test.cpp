/// The slots of a supervisor among owners, and among small jobs and those that take long.

#include "tests/queue/supervised.h"

using queue::JobState;

namespace {

class SupervisorFairness : public SupervisorTest {
 protected:
  std::string submit_for(const std::string& owner, const std::string& document) {
    return submit_job(document, [&](queue::Job& job) { job.owner = owner; });
  }
  /// The default: one owner leaves a slot to the others.
  static worker::SupervisorSettings fair(int slots) {
    worker::SupervisorSettings result = settings(slots);
    result.owner_slots = 0;
    return result;
  }
  /// Jobs become large at once.
  void start_with_small_jobs(int slots) {
    start([](auto& with) { with.small_job_time = std::chrono::milliseconds(1); }, settings(slots));
  }
};

TEST_F(SupervisorFairness, OneOwnerLeavesASlotToOthers) {
  start(fair(3));
  std::vector<std::string> endless;
  for (int i = 0; i < 20; ++i) endless.push_back(submit_for("ann", "wait " + path("go")));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 2; }));
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(reaches(submit_for("bob", "finish small"), JobState::succeeded));
  EXPECT_EQ(store.count(JobState::running), 2);
  EXPECT_EQ(store.count(JobState::queued), 18);
  create("go");
  for (const std::string& id : endless) EXPECT_TRUE(reaches(id, JobState::succeeded)) << "each end is a claim";
}

TEST_F(SupervisorFairness, AnOwnerWithoutRunningJobsGetsTheNextFreeSlot) {
  start(fair(2));
  submit_for("eve", "wait " + path("eve"));
  submit_for("ann", "wait " + path("ann"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 2; }));
  std::vector<std::string> of_ann;
  for (int i = 0; i < 50; ++i) of_ann.push_back(submit_for("ann", "wait " + path("never")));
  const std::string of_bob = submit_for("bob", "wait " + path("bob"));
  create("ann");
  ASSERT_TRUE(reaches(of_bob, JobState::running));
  for (const std::string& id : of_ann) EXPECT_EQ(state(id), JobState::queued);
  create("bob");
  ASSERT_TRUE(reaches(of_ann.front(), JobState::running));
}

TEST_F(SupervisorFairness, AnOwnerLeavesItsLimitDuringAClaimThatExcludesIt) {
  start(fair(2));
  submit_for("ann", "wait " + path("go"));
  ASSERT_TRUE(eventually([&] { return supervisor->running() == 1; }));
  hooks.after_limited_claim = [&] {
    create("go");
    EXPECT_TRUE(eventually([&] { return supervisor->running() == 0; }));
  };
  EXPECT_TRUE(reaches(submit_for("ann", "finish next"), JobState::succeeded));
}

TEST_F(SupervisorFairness, AnOwnerAtItsLimitContinuesWhenTheWorkerIsReplaced) {
  start(fair(2));
  submit_for("ann", "exit 1");
  const std::string next = submit_for("ann", "finish next");
  EXPECT_TRUE(reaches(next, JobState::succeeded));
}

/// Three jobs that look small and do not end: two of them remain, as large ones.
TEST_F(SupervisorFairness, JobsThatTakeLongLeaveASlotToSmallOnes) {
  start_with_small_jobs(3);
  std::vector<std::string> endless;
  for (int i = 0; i < 3; ++i) endless.push_back(submit("wait " + path("go")));
  ASSERT_TRUE(eventually([&] { return log.count("job_became_large") >= 3; }));
  ASSERT_TRUE(eventually([&] { return store.count(JobState::queued) == 1; })) << "one was stopped";
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(reaches(submit("finish small"), JobState::succeeded));
  EXPECT_EQ(store.count(JobState::running), 2);
  for (const std::string& id : endless) {
    if (state(id) != JobState::queued) continue;
    EXPECT_TRUE(find(id).large);
    EXPECT_EQ(find(id).attempt, 0) << "the attempt does not count";
  }
  create("go");
  for (const std::string& id : endless) EXPECT_TRUE(reaches(id, JobState::succeeded));
}

TEST_F(SupervisorFairness, AJobThatTakesLongKeepsASingleSlot) {
  start_with_small_jobs(1);
  const std::string first = submit("wait " + path("go")), second = submit("finish second");
  ASSERT_TRUE(reaches(first, JobState::running));
  create("go");
  EXPECT_TRUE(reaches(second, JobState::succeeded));
  EXPECT_EQ(find(first).attempt, 1);
  EXPECT_EQ(log.count("job_released"), 0);
}

TEST_F(SupervisorFairness, AJobThatLeavesItsSlotCanBeCancelled) {
  start_with_small_jobs(2);
  std::vector<std::string> endless;
  for (int i = 0; i < 4; ++i) endless.push_back(submit("wait " + path("never")));
  ASSERT_TRUE(eventually([&] { return log.count("job_released") >= 2; }));
  for (const std::string& id : endless) queue.lifecycle.cancel(id);
  for (const std::string& id : endless) EXPECT_TRUE(reaches(id, JobState::cancelled));
}

}  // namespace
