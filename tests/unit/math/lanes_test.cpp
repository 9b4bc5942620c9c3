// Compaction of lanes, for every mask.
#include "tracer/src/math/lanes.h"

#include <gtest/gtest.h>

#include <vector>

namespace tracer {
namespace {

TEST(Compress, CompactsTheLanesOfEveryMaskInOrder) {
  double eights[2][lanes];
  std::uint32_t fours[lanes];
  for (int i = 0; i < lanes; ++i) {
    eights[0][i] = 100 + i;
    eights[1][i] = -i;
    fours[i] = 1000u + static_cast<std::uint32_t>(i);
  }
  for (LaneMask mask = 0; mask <= all_lanes; ++mask) {
    double to[2][lanes];
    std::uint32_t to_four[lanes];
    const Compressed both[] = {{eights[0], to[0]}, {eights[1], to[1]}};
    compress_eights(both, 2, mask);
    const Compressed four{fours, to_four};
    compress_fours(&four, 1, mask);
    int kept = 0;
    for (int i = 0; i < lanes; ++i) {
      if ((mask >> i & 1) == 0) continue;
      ASSERT_EQ(to[0][kept], 100 + i) << mask;
      ASSERT_EQ(to[1][kept], -i) << mask;
      ASSERT_EQ(to_four[kept], 1000u + static_cast<std::uint32_t>(i)) << mask;
      ++kept;
    }
  }
}

TEST(Compress, WritesAtMostSixteenValues) {
  for (const LaneMask mask : {LaneMask{0}, LaneMask{1}, LaneMask{0x8001}, LaneMask{0x7fff}, all_lanes}) {
    const double from[lanes] = {};
    std::vector<double> to(lanes + 1, 7);
    const Compressed component{from, to.data()};
    compress_eights(&component, 1, mask);
    EXPECT_EQ(to[lanes], 7) << mask;
  }
}

TEST(LaneMask, VisitsItsLanesInOrder) {
  std::vector<int> seen;
  for_each_lane(0x8005, [&](int lane) { seen.push_back(lane); });
  EXPECT_EQ(seen, (std::vector<int>{0, 2, 15}));
  EXPECT_EQ(first_lanes(lanes), all_lanes);
  EXPECT_EQ(first_lanes(3), 7u);
}

}  // namespace
}  // namespace tracer
