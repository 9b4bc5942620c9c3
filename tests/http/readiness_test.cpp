#include <gtest/gtest.h>

#include <thread>

#include "server/http/handlers/handlers.h"

namespace {

class ReadinessTest : public testing::Test {
 protected:
  http::Health health() {
    http::Health health;
    health.not_ready = [this] {
      ++probes;
      return reason;
    };
    health.draining = [this] { return draining; };
    return health;
  }
  int probes = 0;
  std::string reason;
  bool draining = false;
};

TEST_F(ReadinessTest, ProbesAtMostOnceASecond) {
  http::handlers::Readiness readiness(health());
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(readiness.reason(), "");
  const auto seconds =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_LE(probes, 1 + seconds);
}

TEST_F(ReadinessTest, ProbesAgainLater) {
  http::handlers::Readiness readiness(health());
  EXPECT_EQ(readiness.reason(), "");
  reason = "store: gone";
  while (readiness.reason().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(probes, 2);
}

TEST_F(ReadinessTest, ReportsADrainAtOnce) {
  http::handlers::Readiness readiness(health());
  EXPECT_EQ(readiness.reason(), "");
  draining = true;
  EXPECT_EQ(readiness.reason(), "draining");
}

}  // namespace
