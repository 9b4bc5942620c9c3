// The scale of errors, against the sRGB curve in long double.
#include "tracer/src/display/display_transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace tracer {
namespace {

/// IEC 61966-2-1:1999, clause 5.2.
long double encoded(long double linear) {
  const long double x = std::fmin(linear, 1.0L);
  return 255 * (x <= 0.0031308L ? 12.92L * x : 1.055L * std::pow(x, 1 / 2.4L) - 0.055L);
}

Output output(double exposure, Output::Overflow overflow) {
  Output output;
  output.exposure = exposure;
  output.overflow = overflow;
  return output;
}

TEST(DisplayTransform, FollowExposureClampAndTheCurve) {
  oracle::Random random(1);
  for (const double exposure : {0.0, 1.5, -3.0}) {
    const DisplayTransform display(output(exposure, Output::Overflow::clamp), 7);
    for (int i = 0; i < 20'000; ++i) {
      const double x = random.chance(0.5) ? random.in(0, 2) : random.spread(1e-9, 1e3);
      ASSERT_NEAR(display.level(x), static_cast<double>(encoded(x * std::exp2(static_cast<long double>(exposure)))),
                  1e-3)
          << x;
    }
    EXPECT_EQ(display.level(0), 0);
    EXPECT_NEAR(display.level(1e300), 255, 1e-4);
  }
}

TEST(DisplayTransform, AreTheSameOfRowsAsOfSinglePixelsAndCloserToTheCurve) {
  oracle::Random random(3);
  std::vector<float> rgb(3 * 20'000 + 3);
  for (float& value : rgb) value = static_cast<float>(random.chance(0.1) ? 0 : random.spread(1e-9, 1e3));
  for (std::size_t i = 0; i < rgb.size(); i += 2) rgb[i] = static_cast<float>(random.in(0, 1.1));
  rgb[0] = 0.0031308f;
  rgb[1] = std::nextafter(rgb[0], 1.0f);
  rgb[2] = 1;
  rgb[5] = std::numeric_limits<float>::max();
  for (const auto& [overflow, exposure] : {std::pair{Output::Overflow::clamp, 0.5},
                                           {Output::Overflow::clamp, 0.0},
                                           {Output::Overflow::reinhard, 0.5},
                                           {Output::Overflow::clamp, 100.0},
                                           {Output::Overflow::reinhard, 100.0}}) {
    const DisplayTransform display(output(exposure, overflow), 7);
    std::array<std::vector<float>, 3> planes;
    planes.fill(std::vector<float>(rgb.size() / 3));
    display.show(rgb, planes);
    for (std::size_t i = 0; i < rgb.size(); ++i) {
      ASSERT_NEAR(planes[i % 3][i / 3], display.level(rgb[i]), 1e-3) << rgb[i];
      const double tolerance = exposure == 0 ? 2e-4 : 255;
      ASSERT_NEAR(planes[i % 3][i / 3], static_cast<double>(encoded(rgb[i])), tolerance) << rgb[i];
    }
  }
}

TEST(DisplayTransform, DivideByTheBrightestWhereThatIsAboveOne) {
  EXPECT_NEAR(DisplayTransform(output(0, Output::Overflow::scale), 4).level(2), static_cast<double>(encoded(0.5L)),
              1e-3);
  EXPECT_NEAR(DisplayTransform(output(0, Output::Overflow::scale), 0.5).level(0.25),
              static_cast<double>(encoded(0.25L)), 1e-3);
}

TEST(DisplayTransform, FollowReinhard) {
  const DisplayTransform display(output(1, Output::Overflow::reinhard), 100);
  for (const double x : {0.001, 0.1, 1.0, 30.0, 1e6})
    EXPECT_NEAR(display.level(x), static_cast<double>(encoded(2.0L * x / (1 + 2.0L * x))), 1e-3) << x;
}

TEST(DisplayTransform, SlopeIsTheDerivative) {
  oracle::Random random(2);
  for (const auto overflow : {Output::Overflow::clamp, Output::Overflow::reinhard}) {
    const DisplayTransform display(output(0.5, overflow), 1);
    for (int i = 0; i < 10'000; ++i) {
      const double x = random.spread(1e-4, 0.69), gain = std::exp2(0.5);
      const auto to_display = [&](long double at) {
        const long double y = at * gain;
        return encoded(overflow == Output::Overflow::reinhard ? y / (1 + y) : y);
      };
      const long double step = 1e-6L * x;
      const auto derivative = static_cast<double>((to_display(x + step) - to_display(x - step)) / (2 * step));
      ASSERT_NEAR(display.slope(x) / derivative, 1, 2e-2) << x;
    }
  }
}

TEST(DisplayTransform, HaveNoSlopeAboveWhite) {
  EXPECT_EQ(DisplayTransform(output(1, Output::Overflow::clamp), 1).slope(0.51), 0);
  EXPECT_GT(DisplayTransform(output(1, Output::Overflow::clamp), 1).slope(0.49), 0);
}

}  // namespace
}  // namespace tracer
