#include "tracer/src/parallel/parallel_for.h"

#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <atomic>
#include <limits>

namespace tracer {
namespace {

TEST(ForEachTile, KeepsSubnormalNumbersInAllThreads) {
  const unsigned before = _mm_getcsr();
  _mm_setcsr(before | _MM_FLUSH_ZERO_ON);
  for (const std::uint32_t threads : {0u, 1u, 3u})
    for (const std::uint64_t count : {1u, 300u}) {
      std::atomic<int> kept{0};
      for_each_tile(count, threads, [&](std::uint64_t) {
        const volatile float least = std::numeric_limits<float>::min();
        if (least / 4 > 0) ++kept;
      });
      EXPECT_EQ(kept, static_cast<int>(count)) << threads;
      EXPECT_TRUE(_mm_getcsr() & _MM_FLUSH_ZERO_ON) << "the caller has its arithmetic again";
    }
  _mm_setcsr(before);
}

}  // namespace
}  // namespace tracer
