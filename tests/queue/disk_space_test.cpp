/// Submissions and claims with little space on the disk.

#include <gtest/gtest.h>

#include "tests/queue/supervised.h"

using namespace queue;
using State = DiskSpace::State;

namespace {

class DiskSpaceTest : public QueueFixture {
 protected:
  DiskSpaceTest() : QueueFixture({.disk_space = [this] { return space; }}) {}
  static Submission keyed() {
    Submission submission;
    submission.document = "{}";
    submission.idempotency = Idempotency{"POST /v1/jobs", "key", "sha"};
    submission.write_reply = [](const JobView& view, bool) { return FirstReply{202, "", view.job.id}; };
    return submission;
  }
  DiskSpace space{State::enough, 900, 100};
};

}  // namespace

TEST_F(DiskSpaceTest, RunsAcceptedJobsButAcceptsNoOthersWithScarceSpace) {
  ASSERT_TRUE(queue.submission.submit({.document = "{}"}));
  space = {State::scarce, 99, 100};
  const auto refused = queue.submission.submit({.document = "{}"});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Rejection::Reason::disk_full);
  EXPECT_EQ(refused.error().value, 99);
  EXPECT_EQ(refused.error().limit, 100);
  BatchSubmission batch;
  batch.jobs.emplace_back();
  EXPECT_FALSE(queue.submission.submit_batch(std::move(batch)));
  EXPECT_EQ(store.count(JobState::queued), 1);
  const Claim claim = queue.lifecycle.claim().value();
  EXPECT_TRUE(succeed(claim, "image"));
}

TEST_F(DiskSpaceTest, ClaimsNothingWithoutSpace) {
  ASSERT_TRUE(queue.submission.submit({.document = "{}"}));
  space.state = State::none;
  EXPECT_FALSE(queue.lifecycle.claim());
  EXPECT_FALSE(queue.lifecycle.claim({.suspects = true}));
  space.state = State::scarce;
  EXPECT_TRUE(queue.lifecycle.claim());
}

TEST_F(DiskSpaceTest, RepeatsTheReplyOfAnEarlierRequestWithoutSpace) {
  const std::string first = queue.submission.submit(keyed())->view.job.id;
  space.state = State::none;
  const auto again = queue.submission.submit(keyed());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->replayed.value().body, first);
}

TEST_F(DiskSpaceTest, ReadinessReportsTheMissingSpace) {
  space = {State::scarce, 99, 100};
  EXPECT_EQ(queue.queries.not_ready(),
            "disk: 99 bytes are free on the disk, 100 are kept for jobs that were accepted before");
}

TEST_F(SupervisorTest, ClaimsQueuedJobsOnceTheDiskHasSpace) {
  std::atomic<State> state_of_disk = State::none;
  Queue limited(store.all(), temporary.artifacts, ids, system_clock(), log.log(), {.disk_space = [&] {
                  return DiskSpace{state_of_disk, 0, 1};
                }});
  const std::string queued = submit("");
  const worker::Supervisor over(limited, settings(), log.log());
  ASSERT_TRUE(eventually([&] { return limited.queries.not_ready().starts_with("disk: "); }));
  ASSERT_TRUE(eventually([&] { return log.count("worker_ready") == 1; }));
  EXPECT_EQ(state(queued), JobState::queued);
  state_of_disk = State::enough;
  limited.lifecycle.on_disk_space_available();
  EXPECT_TRUE(reaches(queued, JobState::succeeded));
}
