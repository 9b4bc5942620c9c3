#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "server/http/handlers/routes.h"

namespace {

class ReadinessTest : public testing::Test {
 protected:
  int probes = 0;
  std::string reason;
  std::atomic<bool> draining = false;
  http::Readiness readiness{[this] {
                              ++probes;
                              return reason;
                            },
                            draining};
};

TEST_F(ReadinessTest, ProbesAtMostOnceASecond) {
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(readiness.reason(), "");
  const auto seconds =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_LE(probes, 1 + seconds);
}

TEST_F(ReadinessTest, ProbesAgainLater) {
  EXPECT_EQ(readiness.reason(), "");
  reason = "store: gone";
  while (readiness.reason().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(probes, 2);
}

TEST_F(ReadinessTest, ReportsADrainAtOnce) {
  EXPECT_EQ(readiness.reason(), "");
  draining = true;
  EXPECT_EQ(readiness.reason(), "draining");
}

}  // namespace
