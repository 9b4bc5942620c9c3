// Looks: stratified draws in proportion to bounds, and an estimate that few of them cannot make small.
#include "tracer/src/sampling/looks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace tracer {
namespace {

TEST(Looks, AreNotTrustedIfTheyAreFewAndFindNothing) {
  const double bounds = 5000;
  EXPECT_GT(error_of_looks({}, bounds).squared, 0.49 * bounds);
  EXPECT_NEAR(error_of_looks(std::vector<double>(98), bounds).squared, bounds * (1 / 100.0 - 1.0 / (looks_min + 2)),
              1e-9);
  EXPECT_EQ(error_of_looks(std::vector<double>(looks_min), bounds).squared, 0);
  std::vector<double> ten{70, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_GT(error_of_looks(ten, bounds).squared, 0.08 * bounds) << "nor if they find little";
  ten[1] = 2 * bounds;
  EXPECT_DOUBLE_EQ(error_of_looks(ten, bounds).squared, (70 + 2 * bounds) / 10);
}

TEST(Looks, ByBoundsAloneAreOneInEachEqualPartOfTheirSum) {
  std::vector<float> bounds(900, 1);
  std::fill(bounds.begin() + 800, bounds.end(), 8.0F);  // half of the sum in the last 100
  EXPECT_TRUE(draw_looks(std::vector<float>(10), 5, 0, 0).empty()) << "none without bounds";
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const std::vector<Look> looks = draw_looks(bounds, 16, 0, seed);
    ASSERT_EQ(looks.size(), 16U);
    for (std::size_t i = 0; i < 16; ++i) {
      const double part = i < 8 ? 100.0 * static_cast<double>(i) : 800 + 12.5 * static_cast<double>(i - 8);
      EXPECT_GE(looks[i].place, std::floor(part)) << i;
      EXPECT_LE(looks[i].place, std::floor(part + (i < 8 ? 100 : 12.5))) << i;
      EXPECT_DOUBLE_EQ(looks[i].weight, i < 8 ? 1600 : 200) << i;
    }
  }
}

}  // namespace
}  // namespace tracer
