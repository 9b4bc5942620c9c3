// Sample positions: stratified like a (0,2)-sequence, and different in every pixel.
#include "tracer/src/math/sampling.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/chi_square.h"
#include "tests/support/effort.h"

namespace tracer {
namespace {

constexpr std::uint32_t many = 1u << 20;  // a count above 1 whose points no shorter count changes

TEST(PixelSamples, FallOneIntoEachElementaryIntervalOfEveryAlignedPowerOfTwo) {
  const std::uint64_t pixels = effort::cases(20);
  for (std::uint64_t pixel = 0; pixel < pixels; ++pixel)
    for (std::uint32_t m = 0; m <= 9; ++m)
      for (std::uint32_t block = 0; block < 3; ++block)
        for (std::uint32_t a = 0; a <= m; ++a) {
          // 2^a columns by 2^(m-a) rows.
          std::vector<int> count(std::size_t{1} << m);
          for (std::uint32_t i = 0; i < (1u << m); ++i) {
            const Vec2 p = pixel_sample(pixel * 7919, (block << m) + i, many, pixel);
            const auto column = static_cast<std::size_t>(std::ldexp(p.x, static_cast<int>(a)));
            const auto row = static_cast<std::size_t>(std::ldexp(p.y, static_cast<int>(m - a)));
            ++count[(row << a) + column];
          }
          for (const int c : count)
            ASSERT_EQ(c, 1) << "pixel " << pixel << " m " << m << " a " << a << " block " << block;
        }
}

TEST(PixelSamples, AreThePixelCenterForASingleSample) {
  for (std::uint64_t pixel = 0; pixel < 100; ++pixel) EXPECT_EQ(pixel_sample(pixel, 0, 1, pixel), (Vec2{0.5, 0.5}));
}

TEST(PixelSamples, ContainThePointsOfSmallerCounts) {
  for (std::uint64_t pixel = 0; pixel < 100; ++pixel)
    for (std::uint32_t count = 2; count < 40; ++count)
      for (std::uint32_t i = 0; i < count; ++i)
        ASSERT_EQ(pixel_sample(pixel, i, count, 5), pixel_sample(pixel, i, count + 1, 5));
}

/// Chi-square of `samples` over 16 x 16 bins, as standard deviations from its mean.
double excess_of_chi_square(const std::vector<Vec2>& samples) {
  constexpr std::size_t side = 16, bins = side * side;
  std::vector<double> count(bins);
  for (const Vec2& p : samples)
    ++count[static_cast<std::size_t>(p.x * side) * side + static_cast<std::size_t>(p.y * side)];
  return statistics::chi_square_deviate(count, std::vector(bins, static_cast<double>(samples.size()) / bins));
}

TEST(PixelSamples, OfOneIndexAreUniformOverThePixelsAndOverTheSeeds) {
  const std::uint64_t pixels = effort::cases(100'000);
  for (const std::uint32_t index : {0u, 1u, 2u, 5u}) {
    std::vector<Vec2> over_pixels, over_seeds;
    for (std::uint64_t i = 0; i < pixels; ++i) {
      over_pixels.push_back(pixel_sample(i, index, 16, 0));
      over_seeds.push_back(pixel_sample(0, index, 16, i));
    }
    EXPECT_LT(std::fabs(excess_of_chi_square(over_pixels)), 5) << index;
    EXPECT_LT(std::fabs(excess_of_chi_square(over_seeds)), 5) << index;
  }
}

TEST(PixelSamples, OfNeighboringPixelsAndSeedsAreUncorrelated) {
  const auto n = static_cast<double>(effort::cases(100'000));
  for (const std::uint64_t step : {1u, 2u, 640u, 4096u})
    for (const std::uint64_t seed_step : {0u, 1u}) {
      double xx = 0, xy = 0, yy = 0;
      for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(n); ++i) {
        const Vec2 p = pixel_sample(i, 1, 4, 9), q = pixel_sample(i + step, 1, 4, 9 + seed_step);
        xx += (p.x - 0.5) * (q.x - 0.5);
        yy += (p.y - 0.5) * (q.y - 0.5);
        xy += (p.x - 0.5) * (q.y - 0.5);
      }
      // Each product has variance 1/144.
      for (const double sum : {xx, yy, xy})
        EXPECT_LT(std::fabs(sum * 12 / std::sqrt(n)), 5) << step << " " << seed_step;
    }
}

TEST(LensSamples, AreIndependentOfThePositionInThePixel) {
  constexpr std::uint32_t count = 4096;
  for (std::uint64_t key = 1; key <= 20; ++key) {
    std::array<int, 16> seen{};  // of the quarters of x in the pixel and of x on the lens
    for (std::uint32_t i = 0; i < count; ++i) {
      const Vec2 pixel = pixel_sample(mix(key), i, count), lens = lens_sample(mix(key), i, count);
      ++seen[static_cast<std::size_t>(pixel.x * 4) * 4 + static_cast<std::size_t>(lens.x * 4)];
    }
    for (const int n : seen) EXPECT_NEAR(n, count / 16.0, 80) << "key " << key;  // five standard deviations
  }
}

TEST(LensSamples, AreTheCenterWhenThereIsOneAndStratifiedInEveryAlignedBlockWhenThereAreMore) {
  EXPECT_EQ(lens_sample(mix(7), 0, 1), (Vec2{0.5, 0.5}));
  for (std::uint32_t block = 0; block < 200; ++block) {
    std::array<int, 16> seen{};
    for (std::uint32_t i = 0; i < 16; ++i) {
      const Vec2 p = lens_sample(mix(block), block * 16 + i, many);
      ++seen[static_cast<std::size_t>(p.x * 4) * 4 + static_cast<std::size_t>(p.y * 4)];
    }
    for (const int n : seen) EXPECT_EQ(n, 1);
  }
}

TEST(PointOfCircle, IsTheCosineAndTheSine) {
  for (int i = 0; i <= 100000; ++i) {
    const double turn = i / 100000.0;
    const long double angle = 2 * std::numbers::pi_v<long double> * turn;
    const Vec2 p = point_of_circle(turn);
    EXPECT_NEAR(p.x, static_cast<double>(std::cos(angle)), 3e-16) << turn;
    EXPECT_NEAR(p.y, static_cast<double>(std::sin(angle)), 3e-16) << turn;
  }
}

}  // namespace
}  // namespace tracer
