/// What the queue does with the room that the disk has: accepts, runs, or waits.

#include <gtest/gtest.h>

#include "server/queue/queue.h"
#include "server/storage/memory/memory_artifact_store.h"
#include "server/storage/memory/memory_job_store.h"
#include "tests/conformance/memory_file.h"
#include "tests/queue/supervised.h"

using namespace queue;
using State = DiskSpace::State;

namespace {

class RoomTest : public testing::Test {
 protected:
  RoomTest() {
    queue.set_disk_probe([this] { return room; });
  }
  static Submission keyed() {
    Submission submission;
    submission.document = "{}";
    submission.idempotency = Idempotency{"POST /v1/jobs", "key", "sha"};
    submission.write_reply = [](const JobView& view, bool) { return FirstReply{202, "", view.job.id}; };
    return submission;
  }
  DiskSpace room{State::enough, 900, 100};
  MemoryJobStore store;
  MemoryArtifactStore artifacts;
  IdSource ids{system_clock(), system_random()};
  Queue queue{store, artifacts, ids, system_clock(), no_log(), {}};
};

}  // namespace

TEST_F(RoomTest, WithScarceRoomNothingNewIsAcceptedAndWhatWasRunsAndEnds) {
  ASSERT_TRUE(queue.submit({.document = "{}"}));
  room = {State::scarce, 99, 100};
  const auto refused = queue.submit({.document = "{}"});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().why, Refused::Why::disk_full);
  EXPECT_EQ(refused.error().seen, 99);
  EXPECT_EQ(refused.error().limit, 100);
  BatchSubmission batch;
  batch.jobs.emplace_back();
  EXPECT_FALSE(queue.submit_batch(std::move(batch)));
  EXPECT_EQ(store.count(JobState::queued), 1);
  const Claim claim = queue.claim(false).value();
  const MemoryFile image("image");
  EXPECT_TRUE(queue.succeed(claim.job.id, claim.fence, "{}", {{"image.png", "image/png", image.fd()}}));
}

TEST_F(RoomTest, WithoutRoomNothingIsBegunUntilItComes) {
  ASSERT_TRUE(queue.submit({.document = "{}"}));
  room.state = State::none;
  EXPECT_FALSE(queue.claim(false));
  EXPECT_FALSE(queue.claim(true));
  room.state = State::scarce;
  EXPECT_TRUE(queue.claim(false));
}

TEST_F(RoomTest, ARequestThatWasAnsweredBeforeIsAnsweredAgainWithoutRoom) {
  const std::string first = queue.submit(keyed())->view.job.id;
  room.state = State::none;
  const auto again = queue.submit(keyed());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->replayed.value().body, first);
}

TEST_F(RoomTest, ReadinessTellsHowMuchIsMissing) {
  room = {State::scarce, 99, 100};
  EXPECT_EQ(queue.not_ready(), "disk: 99 bytes are free on the disk, 100 are kept for jobs that were accepted before");
}

TEST_F(SupervisorTest, JobsThatWaitedForRoomAreBegunWhenItComes) {
  std::atomic<State> state_of_disk = State::none;
  const std::string waiting = submit("");
  queue.set_disk_probe([&] { return DiskSpace{state_of_disk, 0, 1}; });
  start();
  ASSERT_TRUE(eventually([&] { return queue.not_ready().starts_with("disk: "); }));
  ASSERT_TRUE(eventually([&] { return log.count("worker_ready") == 1; }));
  EXPECT_EQ(state(waiting), JobState::queued);
  state_of_disk = State::enough;
  queue.on_disk_space_available();
  EXPECT_TRUE(reaches(waiting, JobState::succeeded));
}
