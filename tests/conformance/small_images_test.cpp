/// Images that stand beside the rows which name them.

#include "tests/conformance/job_store_conformance.h"

using namespace queue;

namespace {

const std::string sha256_of_a(64, 'a'), sha256_of_b(64, 'b');

std::vector<Artifact> named(const std::string& sha256) { return {{"image.png", "image/png", sha256, 3}}; }

}  // namespace

TEST_P(JobStoreConformance, ASmallImageIsThereWithTheEndOfItsJob) {
  std::string bytes;
  for (int i = 0; i < 3 * 256; ++i) bytes.push_back(static_cast<char>(i));
  const std::string id = submit();
  EXPECT_FALSE(store().small_image(sha256_of_a));
  EXPECT_TRUE(store().succeed(id, claim().fence, now, "{}", named(sha256_of_a), true,
                              {{sha256_of_a, bytes}, {sha256_of_b, ""}}));
  reopen();
  EXPECT_EQ(store().small_image(sha256_of_a), bytes);
  EXPECT_EQ(store().small_image(sha256_of_b), "");
  EXPECT_FALSE(store().small_image("no such image"));
}

TEST_P(JobStoreConformance, AResultThatCameTooLateBringsNoSmallImage) {
  const std::string id = submit();
  const Claim late = claim();
  store().release(id, late.fence, now, {});
  EXPECT_FALSE(store().succeed(id, late.fence, now, "{}", named(sha256_of_a), true, {{sha256_of_a, "abc"}}));
  EXPECT_FALSE(store().small_image(sha256_of_a));
}

TEST_P(JobStoreConformance, ASmallImageStaysUntilNoJobNamesItAndItIsForgotten) {
  const std::string first = submit(), second = submit();
  for (int i = 0; i < 2; ++i) {
    const Claim job = claim();
    EXPECT_TRUE(store().succeed(job.job.id, job.fence, now, "{}", named(sha256_of_a), true, {{sha256_of_a, "abc"}}));
  }
  store().forget_small_image(sha256_of_a);
  store().remove(first);
  store().forget_small_image(sha256_of_a);
  EXPECT_EQ(store().small_image(sha256_of_a), "abc") << "the second job names it";
  store().remove(second);
  EXPECT_EQ(store().small_image(sha256_of_a), "abc") << "another job may be about to name it";
  store().forget_small_image(sha256_of_a);
  store().forget_small_image(sha256_of_a);
  reopen();
  EXPECT_FALSE(store().small_image(sha256_of_a));
}
