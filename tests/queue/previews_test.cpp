/// Previews of running jobs and their requests.

#include <gtest/gtest.h>

#include "server/queue/job_waiters.h"

using namespace queue;

namespace {

class PreviewsTest : public testing::Test {
 protected:
  Previews::Request request(const std::string& id, std::uint32_t side = 512) {
    return previews.request(id, side, [this] { ++called; });
  }
  void add(const std::string& id, std::uint32_t side, const std::string& png) {
    previews.begin(id);
    for (const auto& call : previews.add(id, side, png)) call();
  }
  std::string latest(const std::string& id, std::uint32_t side = 512) {
    const Previews::Latest found = previews.latest(id, side);
    return found.png ? *found.png : "";
  }

  std::int64_t now = 1'000'000;
  Previews previews{[this] { return now; }};
  int called = 0;
};

}  // namespace

TEST_F(PreviewsTest, SharesOneRequestBetweenWaiters) {
  EXPECT_TRUE(request("a").is_new);
  EXPECT_FALSE(request("a").is_new);
  EXPECT_TRUE(request("a", 64).is_new) << "another size";
  EXPECT_TRUE(request("b").is_new);
  add("a", 512, "image");
  EXPECT_EQ(called, 2);
  EXPECT_TRUE(request("a").is_new) << "for the next one";
}

TEST_F(PreviewsTest, PreviewsAreFreshForHalfASecond) {
  add("a", 512, "image");
  EXPECT_TRUE(previews.latest("a", 512).fresh);
  now += Previews::fresh_ms;
  EXPECT_TRUE(previews.latest("a", 512).fresh);
  now += 1;
  EXPECT_FALSE(previews.latest("a", 512).fresh);
  EXPECT_EQ(latest("a"), "image") << "it is still the latest";
}

TEST_F(PreviewsTest, DoesNotCallACancelledWaiter) {
  previews.cancel(request("a").token);
  add("a", 512, "image");
  EXPECT_EQ(called, 0);
  previews.cancel({"unknown", 512, 12345});  // unknown
}

TEST_F(PreviewsTest, DropsPreviewsAndCallsWaitersAtTheEndOfAJob) {
  add("a", 512, "image");
  add("ab", 512, "another's");
  request("a");
  request("a", 64);
  request("ab");
  for (const auto& call : previews.end("a")) call();
  EXPECT_EQ(called, 2);
  EXPECT_EQ(latest("a"), "");
  EXPECT_EQ(latest("ab"), "another's");
}

TEST_F(PreviewsTest, DropsTheOldestSizeOfAJob) {
  for (std::uint32_t side = 1; side <= Previews::sides_max + 1; ++side) {
    add("a", side, "image");
    ++now;
  }
  EXPECT_EQ(latest("a", 1), "");
  for (std::uint32_t side = 2; side <= Previews::sides_max + 1; ++side) EXPECT_EQ(latest("a", side), "image");
  add("a", 2, "newer");  // in its own place
  EXPECT_EQ(latest("a", 3), "image");
}
