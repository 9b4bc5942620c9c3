/// The images of jobs, small and others: there as long as a job names them, and no longer.

#include <gtest/gtest.h>

#include <thread>

#include "server/queue/queue.h"
#include "server/storage/memory/memory_artifact_store.h"
#include "server/storage/memory/memory_job_store.h"
#include "tests/conformance/memory_file.h"

using namespace queue;

namespace {

/// A store that can be told to fail.
class FailingStore : public MemoryJobStore {
 public:
  bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
               const std::vector<Artifact>& artifacts, bool durable, const std::vector<SmallImage>& small) override {
    if (failing) throw StoreFailure(StoreFailure::Kind::full, "disk full");
    return MemoryJobStore::succeed(id, fence, now, report, artifacts, durable, small);
  }
  bool failing = false;
};

/// The parameter: up to which size images are small.
class ImagesTest : public testing::TestWithParam<std::size_t> {
 protected:
  std::string submit() { return queue.submit({.document = "{}"})->view.job.id; }
  bool succeed(const Claim& claim, const std::string& image) {
    const MemoryFile file(image);
    return queue.succeed(claim.job.id, claim.fence, "{}", {{"image.png", "image/png", file.fd()}});
  }
  JobView find(const std::string& id) { return queue.find(id).value(); }
  std::unique_ptr<ArtifactReader> open_abc() { return queue.open({"image.png", "image/png", abc_sha256, 3}); }

  const std::string abc_sha256 = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";  // FIPS 180-4
  FailingStore store;
  MemoryArtifactStore artifacts;
  IdSource ids{system_clock(), system_random()};
  Queue queue{store, artifacts, ids, system_clock(), no_log(), QueueSettings{.small_image_bytes = GetParam()}};
};

}  // namespace

TEST_P(ImagesTest, SmallOnesAreKeptWithTheRowsAndTheOthersInTheArtifactStore) {
  submit();
  EXPECT_TRUE(succeed(*queue.claim(false), "abc"));
  const bool small = GetParam() >= 3;
  EXPECT_EQ(store.small_image(abc_sha256).has_value(), small);
  EXPECT_EQ(artifacts.open(abc_sha256) == nullptr, small);
  std::string bytes(3, '?');
  EXPECT_EQ(open_abc()->read(0, bytes.data(), 4), 3u);
  EXPECT_EQ(bytes, "abc");
}

TEST_P(ImagesTest, KeepsImagesUntilTheLastJobThatNamesThemIsRemoved) {
  const std::string first = submit(), second = submit();
  EXPECT_TRUE(succeed(*queue.claim(false), "abc"));
  EXPECT_TRUE(succeed(*queue.claim(false), "abc"));
  const Artifact artifact = find(first).job.artifacts.at(0);
  EXPECT_EQ(artifact.sha256, abc_sha256);
  EXPECT_EQ(artifact.bytes, 3u);
  EXPECT_EQ(queue.remove(first), RemoveOutcome::removed);
  EXPECT_NE(queue.open(artifact), nullptr);
  EXPECT_EQ(queue.remove(second), RemoveOutcome::removed);
  EXPECT_EQ(queue.open(artifact), nullptr);
}

TEST_P(ImagesTest, KeepsNothingOfAResultThatCameTooLate) {
  const std::string id = submit();
  const Claim late = *queue.claim(false);
  queue.release(id, late.fence, false, false);
  EXPECT_FALSE(succeed(late, "abc"));
  EXPECT_EQ(open_abc(), nullptr);
}

TEST_P(ImagesTest, KeepsNothingOfAResultWhoseRowCouldNotBeWritten) {
  const std::string id = submit();
  const Claim claim = *queue.claim(false);
  store.failing = true;
  EXPECT_THROW(succeed(claim, "abc"), StoreFailure);
  EXPECT_EQ(open_abc(), nullptr);
  store.failing = false;
  EXPECT_TRUE(succeed(claim, "abc"));
  EXPECT_NE(open_abc(), nullptr);
}

TEST_P(ImagesTest, RemovalNeverTakesTheBytesOfAJobThatFinishesWithTheSameImage) {
  std::atomic<bool> stop = false;
  std::atomic<int> missing = 0, checked = 0;
  const auto finish_and_remove = [&] {
    while (!stop) {
      if (!queue.submit({.document = "{}"})) continue;
      const auto claim = queue.claim(false);
      if (!claim || !succeed(*claim, "abc")) continue;
      if (queue.open(find(claim->job.id).job.artifacts.at(0)) == nullptr) ++missing;
      queue.remove(claim->job.id);
      if (++checked >= 2000) stop = true;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back(finish_and_remove);
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(missing, 0);
  EXPECT_EQ(open_abc(), nullptr) << "the last one took it along";
}

INSTANTIATE_TEST_SUITE_P(Sizes, ImagesTest, testing::Values(0, 2, 3, 1000));
