/// The images of jobs exist as long as a job names them.

#include <gtest/gtest.h>

#include <thread>

#include "server/queue/queue.h"
#include "tests/conformance/memory_file.h"
#include "tests/conformance/temporary_stores.h"

using namespace queue;

namespace {

class FailingTransitions final : public JobTransitions {
 public:
  explicit FailingTransitions(const JobTransitions& target) : JobTransitions(target) {}
  bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
               const std::vector<Artifact>& artifacts, bool durable, bool rendered) override {
    if (failing) throw StoreFailure(StoreFailure::Kind::full, "disk full");
    return JobTransitions::succeed(id, fence, now, report, artifacts, durable, rendered);
  }
  bool failing = false;
};

class ImagesTest : public testing::Test {
 protected:
  std::string submit() { return queue.submission.submit({.document = "{}"})->view.job.id; }
  bool succeed(const Claim& claim, const std::string& image) {
    const MemoryFile file(image);
    return queue.lifecycle.succeed(claim.job.id, claim.fence, "{}", {{"image.png", "image/png", file.fd()}});
  }
  JobView find(const std::string& id) { return queue.queries.find(id).value(); }
  std::unique_ptr<ArtifactReader> open_abc() { return queue.queries.open({"image.png", "image/png", abc_sha256, 3}); }

  const std::string abc_sha256 = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";  // FIPS 180-4
  TemporaryStores temporary;
  TestStore& store = temporary.store;
  const Stores& all = store.all();
  FailingTransitions transitions{all.transitions};
  IdSource ids{system_clock(), system_random()};
  Queue queue{{all.jobs, all.statistics, transitions, all.batches, all.maintenance},
              temporary.artifacts,
              ids,
              system_clock(),
              no_log(),
              {}};
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
  const std::string id = submit();
  const Claim late = *queue.lifecycle.claim();
  queue.lifecycle.release(id, late.fence, {});
  EXPECT_FALSE(succeed(late, "abc"));
  EXPECT_EQ(open_abc(), nullptr);
}

TEST_F(ImagesTest, DeletesTheImagesOfAResultThatCouldNotBeStored) {
  const std::string id = submit();
  const Claim claim = *queue.lifecycle.claim();
  transitions.failing = true;
  EXPECT_THROW(succeed(claim, "abc"), StoreFailure);
  EXPECT_EQ(open_abc(), nullptr);
  transitions.failing = false;
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
  const auto finish_and_remove = [&] {
    while (!stop) {
      if (!queue.submission.submit({.document = "{}"})) continue;
      const auto claim = queue.lifecycle.claim();
      if (!claim || !succeed(*claim, "abc")) continue;
      if (queue.queries.open(find(claim->job.id).job.artifacts.at(0)) == nullptr) ++missing;
      queue.lifecycle.remove(claim->job.id);
      if (++checked >= 500) stop = true;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back(finish_and_remove);
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(missing, 0);
  EXPECT_EQ(open_abc(), nullptr) << "the last one took it along";
}
