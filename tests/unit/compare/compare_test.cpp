// Metrics of comparisons with closed-form results.
#include "tracer/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "tests/unit/compare/made_images.h"
#include "tracer/src/display/srgb.h"

namespace tracer {
namespace {

Comparison compared(const DisplayImage& a, const DisplayImage& b, std::size_t worst_count = 5) {
  auto found = compare(a, b, worst_count);
  EXPECT_TRUE(found) << found.error();
  return *std::move(found);
}

TEST(Comparison, OfAConstantOffsetIsThatOffset) {
  const Comparison found = compared(constant(100), constant(103));
  EXPECT_EQ(found.rmse, 3);
  EXPECT_EQ(found.bias, 3);
  EXPECT_EQ(found.greatest, 3);
  EXPECT_EQ(found.differing, 1);
  EXPECT_DOUBLE_EQ(found.psnr_db, 20 * std::log10(85.0));
  EXPECT_EQ(found.width, 16u);
  EXPECT_EQ(found.height, 12u);
}

TEST(Comparison, OfAnImageWithItselfIsZero) {
  const DisplayImage image = noise(40, 30, 1);
  const Comparison found = compared(image, image);
  EXPECT_EQ(found.rmse, 0);
  EXPECT_EQ(found.rmse_channel, (std::array<double, 3>{}));
  EXPECT_EQ(found.bias, 0);
  EXPECT_EQ(found.greatest, 0);
  EXPECT_EQ(found.psnr_db, INFINITY);
  EXPECT_EQ(found.ssim, 1);
  EXPECT_EQ(found.differing, 0);
  EXPECT_TRUE(found.worst.empty());
}

TEST(HeatMap, OfALargeImageShowsTheGreatestDifferenceThatAPixelCovers) {
  const auto spot = [](std::uint32_t x, std::uint32_t y, int channel) {
    return x == 70 && y == 30 && channel == 1 ? 108.0 : 100.0;
  };
  const Image small = heat_map(constant(100, 90, 60), made(90, 60, spot), 8, 9);
  EXPECT_EQ(small.width, 9u);
  EXPECT_EQ(small.height, 6u);
  for (std::uint32_t y = 0; y < 6; ++y)
    for (std::uint32_t x = 0; x < 9; ++x)
      for (int channel = 0; channel < 3; ++channel)
        EXPECT_FLOAT_EQ(small.pixel(x, y)[channel], x == 7 && y == 3 ? 1.0f : 0.0f) << x << ' ' << y;
  EXPECT_EQ(heat_map(constant(100, 90, 60), made(90, 60, spot), 8, 90).rgb,
            heat_map(constant(100, 90, 60), made(90, 60, spot), 8).rgb);
}

TEST(Comparison, ReportsErrorsPerChannelAndTheirRootMeanSquare) {
  const auto offset = [](auto, auto, int channel) { return std::array{103.0, 96.0, 100.0}[channel]; };
  const Comparison found = compared(constant(100), made(16, 12, offset));
  EXPECT_EQ(found.rmse_channel, (std::array<double, 3>{3, 4, 0}));
  EXPECT_DOUBLE_EQ(found.rmse, std::sqrt(25.0 / 3));
  EXPECT_DOUBLE_EQ(found.bias, -1.0 / 3);
  EXPECT_EQ(found.greatest, 4);
}

TEST(Comparison, OfNoiseEqualsTheSumsInLongDouble) {
  const DisplayImage a = noise(61, 47, 4), b = noise(61, 47, 5);
  long double squares = 0, sum = 0;
  for (std::size_t i = 0; i < a.codes.size(); ++i) {
    const long double difference = (static_cast<long double>(b.codes[i]) - a.codes[i]) / 257;
    squares += difference * difference;
    sum += difference;
  }
  const Comparison found = compared(a, b);
  EXPECT_DOUBLE_EQ(found.rmse, static_cast<double>(std::sqrt(squares / a.codes.size())));
  EXPECT_DOUBLE_EQ(found.bias, static_cast<double>(sum / a.codes.size()));
}

TEST(DifferingPixels, AreThoseMoreThanALevelApartAndNotThoseExactlyALevelApart) {
  DisplayImage a = constant(200, 10, 10), b = a;
  for (const std::size_t pixel : {5u, 17u, 42u}) b.codes[3 * pixel + 1] += 257;
  EXPECT_EQ(compared(a, b).differing, 0);
  b.codes[3 * 17 + 1] += 1;  // a code of 16 bits more than a level
  b.codes[3 * 99 + 2] -= 258;
  EXPECT_DOUBLE_EQ(compared(a, b).differing, 0.02);
}

TEST(WorstPixels, AreSortedByDifferenceThenByPosition) {
  const DisplayImage a = constant(100, 9, 8);
  DisplayImage b = a;
  const auto change = [&](std::uint32_t x, std::uint32_t y, int channel, double levels) {
    b.codes[3 * (y * 9 + x) + channel] += static_cast<float>(levels * codes_per_level);
  };
  change(8, 7, 0, 5);
  change(3, 2, 1, -20);
  change(1, 6, 2, 5);
  change(4, 6, 2, -5);
  change(0, 0, 0, 1);
  const Comparison found = compared(a, b, 4);
  using Worst = std::tuple<std::uint32_t, std::uint32_t, double>;
  std::vector<Worst> worst;
  for (const auto& pixel : found.worst) worst.emplace_back(pixel.x, pixel.y, pixel.difference);
  ASSERT_EQ(worst, (std::vector<Worst>{{3, 2, 20}, {1, 6, 5}, {4, 6, 5}, {8, 7, 5}}));
  EXPECT_EQ(found.worst[0].a, (std::array<double, 3>{100, 100, 100}));
  EXPECT_EQ(found.worst[0].b, (std::array<double, 3>{100, 80, 100}));
  EXPECT_EQ(compared(a, b, 100).worst.size(), 5u) << "only those that differ";
  EXPECT_TRUE(compared(a, b, 0).worst.empty());
}

TEST(Comparison, OfDifferentOrEmptySizesIsRejected) {
  const auto sizes = compare(constant(0, 4, 3), constant(0, 3, 4));
  ASSERT_FALSE(sizes);
  EXPECT_EQ(sizes.error(), "the sizes differ: 4 x 3 and 3 x 4 pixels");
  EXPECT_FALSE(compare({}, {}));
}

TEST(HeatMap, IsBlackWhereNothingDiffersAndWhiteWhereTheScaleEnds) {
  const auto steps = [](std::uint32_t x, auto, int channel) { return channel == 1 ? 10.0 * x : 0; };
  const Image map = heat_map(constant(0, 12, 2), made(12, 2, steps), 100);
  EXPECT_EQ(map.width, 12u);
  EXPECT_EQ(map.height, 2u);
  for (int channel = 0; channel < 3; ++channel) {
    EXPECT_EQ(map.pixel(0, 1)[channel], 0);
    EXPECT_FLOAT_EQ(map.pixel(10, 1)[channel], 1);
    EXPECT_FLOAT_EQ(map.pixel(11, 1)[channel], 1);
  }
}

TEST(HeatMap, FollowsTheColorSchemeOfGreen) {
  // By construction 0.30 R + 0.59 G + 0.11 B is the fraction of the scale, where no channel had to be clipped.
  const auto ramp = [](std::uint32_t x, auto, int channel) { return channel == 2 ? 0.25 * x : 0; };
  const Image map = heat_map(constant(0, 1000, 1), made(1000, 1, ramp), 250);
  int unclipped = 0;
  double last = -1;
  for (std::uint32_t x = 0; x < 1000; ++x) {
    const float* color = map.pixel(x, 0);
    const double brightness =
        0.30 * srgb_from_linear(color[0]) + 0.59 * srgb_from_linear(color[1]) + 0.11 * srgb_from_linear(color[2]);
    EXPECT_GE(brightness, last) << x;
    last = brightness;
    if (color[0] <= 0 || color[1] <= 0 || color[2] <= 0 || color[0] >= 1 || color[1] >= 1 || color[2] >= 1) continue;
    EXPECT_NEAR(brightness, x / 1000.0, 2e-5) << x;  // the coefficients have five digits
    ++unclipped;
  }
  EXPECT_GT(unclipped, 600);
}

TEST(HeatScale, IsAPowerOfTwoOfAtLeastEightTimesTheError) {
  const auto scale = [](double rmse) {
    Comparison comparison;
    comparison.rmse = rmse;
    return heat_scale(comparison);
  };
  EXPECT_EQ(scale(0), 1);
  EXPECT_EQ(scale(0.125), 1);
  EXPECT_EQ(scale(0.2), 2);
  EXPECT_EQ(scale(1), 8);
  EXPECT_EQ(scale(1.01), 16);
  EXPECT_EQ(scale(200), 256);
}

}  // namespace
}  // namespace tracer
