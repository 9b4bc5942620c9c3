/// The images of jobs exist as long as a job names them.

#include <gtest/gtest.h>

#include "tests/queue/queue_fixture.h"
#include "tests/support/threads.h"

using namespace queue;

namespace {

class ImagesTest : public QueueFixture {
 protected:
  std::unique_ptr<ArtifactReader> open_abc() { return queue.queries.open({"image.png", "image/png", abc_sha256, 3}); }

  const std::string abc_sha256 = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";  // FIPS 180-4
};

}  // namespace

TEST_F(ImagesTest, KeepsImagesUntilTheLastJobThatNamesThemIsRemoved) {
  const std::string first = submit(), second = submit();
  EXPECT_TRUE(succeed(*queue.lifecycle.claim(), "abc"));
  EXPECT_TRUE(succeed(*queue.lifecycle.claim(), "abc"));
  const Artifact artifact = find(first).job.artifacts.at(0);
  EXPECT_EQ(artifact.sha256, abc_sha256);
  EXPECT_EQ(artifact.bytes, 3u);
  EXPECT_EQ(queue.lifecycle.remove(first), RemoveOutcome::removed);
  EXPECT_NE(queue.queries.open(artifact), nullptr);
  EXPECT_EQ(queue.lifecycle.remove(second), RemoveOutcome::removed);
  EXPECT_EQ(queue.queries.open(artifact), nullptr);
}

TEST_F(ImagesTest, DeletesTheImagesOfALateResult) {
  const Claim late = submit_and_claim();
  queue.lifecycle.release(late.job.id, late.fence, {});
  EXPECT_FALSE(succeed(late, "abc"));
  EXPECT_EQ(open_abc(), nullptr);
}

TEST_F(ImagesTest, DeletesTheImagesOfAResultThatCouldNotBeStored) {
  const Claim claim = submit_and_claim();
  hooks.failing = "succeed";
  EXPECT_THROW(succeed(claim, "abc"), StoreFailure);
  EXPECT_EQ(open_abc(), nullptr);
  hooks.failing.clear();
  EXPECT_TRUE(succeed(claim, "abc"));
  EXPECT_NE(open_abc(), nullptr);
}

TEST_F(ImagesTest, DeletesTheImageOfAJobThatIsRemovedWhileItsEndIsReported) {
  const std::string id = submit();
  queue.waiters.when_ended(id, [&] { EXPECT_EQ(queue.lifecycle.remove(id), RemoveOutcome::removed); });
  EXPECT_TRUE(succeed(*queue.lifecycle.claim(), "abc"));
  EXPECT_EQ(open_abc(), nullptr);
}

TEST_F(ImagesTest, RemovalKeepsTheImageOfAJobThatFinishesWithTheSameBytes) {
  std::atomic<bool> stop = false;
  std::atomic<int> missing = 0, checked = 0;
  in_threads(4, [&](int) {
    while (!stop) {
      if (!queue.submission.submit({.document = "{}"})) continue;
      const auto claim = queue.lifecycle.claim();
      if (!claim || !succeed(*claim, "abc")) continue;
      if (queue.queries.open(find(claim->job.id).job.artifacts.at(0)) == nullptr) ++missing;
      queue.lifecycle.remove(claim->job.id);
      if (++checked >= 500) stop = true;
    }
  });
  EXPECT_EQ(missing, 0);
  EXPECT_EQ(open_abc(), nullptr) << "the last one took it along";
}
