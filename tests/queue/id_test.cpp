#include <gtest/gtest.h>

#include <cctype>
#include <mutex>
#include <set>

#include "server/queue/clock.h"
#include "tests/support/threads.h"

using namespace queue;

TEST(IdSource, WritesTheExampleOfTheStandard) {
  // RFC 9562, appendix A.6: 2022-02-22 14:22:22.000, rand_a = 0xCC3, rand_b = 0x18C4DC0C0C07398F. Our counter starts in
  // the lower half of its range, so it shows 0x4C3 for the same bits.
  int draws = 0;
  IdSource ids([] { return 0x017F22E279B0; }, [&] { return draws++ == 0 ? 0xCC3ull : 0x18C4DC0C0C07398Full << 2; });
  EXPECT_EQ(ids.next(), "017f22e2-79b0-74c3-98c4-dc0c0c07398f");
}

TEST(IdSource, GrowsWithinAMillisecondAndWhenTheClockStepsBack) {
  std::int64_t now = 1'700'000'000'000;
  IdSource ids([&] { return now; }, system_random());
  std::string last = ids.next();
  for (int i = 0; i < 20'000; ++i) {  // more than the counter holds
    if (i == 10'000) now -= 5'000;
    const std::string next = ids.next();
    ASSERT_LT(last, next);
    last = next;
  }
}

TEST(IdSource, GivesLowerCaseUuidsOfVersionSeven) {
  const std::string shape = "hhhhhhhh-hhhh-7hhh-vhhh-hhhhhhhhhhhh";
  IdSource ids(system_clock(), system_random());
  for (int i = 0; i < 100; ++i) {
    std::string id = ids.next();
    for (std::size_t at = 0; at < id.size(); ++at) {
      const std::string_view allowed = at == 19 ? "89ab" : "0123456789abcdef";
      if (at < shape.size() && std::isalpha(shape[at]) && allowed.find(id[at]) != std::string_view::npos) {
        id[at] = shape[at];
      }
    }
    EXPECT_EQ(id, shape);
  }
}

TEST(IdSource, GivesNoIdTwiceToAnyThread) {
  IdSource ids(system_clock(), system_random());
  std::mutex mutex;
  std::set<std::string> all;
  in_threads(4, [&](int) {
    for (int i = 0; i < 1000; ++i) {
      const std::string id = ids.next();
      const std::lock_guard lock(mutex);
      all.insert(id);
    }
  });
  EXPECT_EQ(all.size(), 4000u);
}
