// SSIM compared with Wang et al. 2004, window by window, in long double.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/compare/made_images.h"
#include "tracer/compare.h"

namespace tracer {
namespace {

using Long = long double;

constexpr Long c1 = 0.01L * 255 * 0.01L * 255, c2 = 0.03L * 255 * 0.03L * 255;

double ssim(const DisplayImage& a, const DisplayImage& b) {
  const auto found = compare(a, b);
  EXPECT_TRUE(found && found->ssim);
  return *found->ssim;
}

Long luma(const DisplayImage& image, std::size_t x, std::size_t y) {
  const float* codes = &image.codes[3 * (y * image.width + x)];
  return (0.2126L * codes[0] + 0.7152L * codes[1] + 0.0722L * codes[2]) / 257;
}

/// Sum over one window of `of(x, y)` under the two-dimensional Gaussian.
template <class Value>
Long window_mean(std::size_t left, std::size_t top, const Value& of) {
  Long sum = 0, weights = 0;
  for (std::size_t j = 0; j < 11; ++j)
    for (std::size_t i = 0; i < 11; ++i) {
      const Long u = static_cast<Long>(i) - 5, v = static_cast<Long>(j) - 5;
      const Long weight = std::exp(-(u * u + v * v) / (2 * 1.5L * 1.5L));
      sum += weight * of(left + i, top + j);
      weights += weight;
    }
  return sum / weights;
}

Long window_ssim(const DisplayImage& a, const DisplayImage& b, std::size_t left, std::size_t top) {
  const Long mean_a = window_mean(left, top, [&](auto x, auto y) { return luma(a, x, y); });
  const Long mean_b = window_mean(left, top, [&](auto x, auto y) { return luma(b, x, y); });
  const auto moment = [&](const DisplayImage& p, Long mean_p, const DisplayImage& q, Long mean_q) {
    return window_mean(left, top, [&](auto x, auto y) { return (luma(p, x, y) - mean_p) * (luma(q, x, y) - mean_q); });
  };
  const Long variances = moment(a, mean_a, a, mean_a) + moment(b, mean_b, b, mean_b);
  return (2 * mean_a * mean_b + c1) * (2 * moment(a, mean_a, b, mean_b) + c2) /
         ((mean_a * mean_a + mean_b * mean_b + c1) * (variances + c2));
}

TEST(Ssim, IsTheMeanOverTheWindowsWithinTheImage) {
  const DisplayImage a = noise(19, 14, 1);
  const DisplayImage b = made(19, 14, [&](std::uint32_t x, std::uint32_t y, int channel) {
    return 0.8 * a.codes[3 * (y * 19 + x) + channel] / codes_per_level + 3.0 * x + 5 * (y % 3);
  });
  Long sum = 0;
  for (std::size_t top = 0; top <= 3; ++top)
    for (std::size_t left = 0; left <= 8; ++left) sum += window_ssim(a, b, left, top);
  EXPECT_NEAR(ssim(a, b), static_cast<double>(sum / 36), 1e-13);
}

TEST(Ssim, OfTwoConstantsIsTheLuminanceTerm) {
  for (const auto& [p, q] : {std::pair{100.0, 130.0}, {0.0, 255.0}, {7.0, 8.0}})
    EXPECT_NEAR(ssim(constant(p), constant(q)), (2 * p * q + 6.5025) / (p * p + q * q + 6.5025), 1e-12)
        << p << " " << q;
}

TEST(Ssim, IsUnsetBelowElevenPixels) {
  EXPECT_TRUE(compare(constant(1, 11, 11), constant(2, 11, 11))->ssim);
  EXPECT_FALSE(compare(constant(1, 10, 200), constant(2, 10, 200))->ssim);
  EXPECT_FALSE(compare(constant(1, 200, 10), constant(2, 200, 10))->ssim);
}

}  // namespace
}  // namespace tracer
