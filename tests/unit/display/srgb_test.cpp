// sRGB codes compared with IEC 61966-2-1 in long double.
#include "tracer/src/display/srgb.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace {

long double curve(long double linear) {
  if (linear <= 0.0031308L) return 12.92L * linear;
  return 1.055L * std::pow(linear, 1.0L / 2.4L) - 0.055L;
}

/// Half up; no float in [0,1] but 0 and 1 makes the curve reach a half exactly.
int nearest_code(float linear, long double code_max = 255.0L) {
  return static_cast<int>(std::floor(code_max * curve(static_cast<long double>(linear)) + 0.5L));
}

TEST(SrgbCode, IsTheNearestToTheCurveForAHundredThousandFloatsSpreadOverAllScales) {
  std::mt19937 random(1);  // NOLINT: the same floats every time
  std::uniform_int_distribution<std::uint32_t> bits(0, std::bit_cast<std::uint32_t>(1.0F));
  std::uniform_real_distribution<float> unit(0, 1);
  for (int i = 0; i < 50'000; ++i) {
    for (const float linear : {std::bit_cast<float>(bits(random)), unit(random)}) {
      ASSERT_EQ(tracer::srgb8_from_linear(linear), nearest_code(linear)) << "linear " << std::hexfloat << linear;
    }
  }
}

TEST(SrgbCode, ChangesExactlyWhereTheCurvePassesAHalfAndNowhereElse) {
  // Bisect for the first float of each code with the oracle, then check it and the last float before it.
  for (int code = 1; code < 256; ++code) {
    std::uint32_t below = 0, from = std::bit_cast<std::uint32_t>(1.0F);
    while (from - below > 1) {
      const std::uint32_t middle = below + (from - below) / 2;
      (nearest_code(std::bit_cast<float>(middle)) >= code ? from : below) = middle;
    }
    ASSERT_EQ(tracer::srgb8_from_linear(std::bit_cast<float>(from)), code) << std::bit_cast<float>(from);
    ASSERT_EQ(tracer::srgb8_from_linear(std::bit_cast<float>(below)), code - 1) << std::bit_cast<float>(below);
  }
}

TEST(SrgbCode, ClampsValuesOutsideOfZeroToOne) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  for (const float dark : {-0.0F, -1e-30F, -1.0F, -1e30F, -infinity}) EXPECT_EQ(tracer::srgb8_from_linear(dark), 0);
  for (const float bright : {1.0F, 1.0000001F, 7.0F, 1e30F, infinity})
    EXPECT_EQ(tracer::srgb8_from_linear(bright), 255);
}

TEST(SrgbCode, OfNanIsBlack) {
  EXPECT_EQ(tracer::srgb8_from_linear(std::numeric_limits<float>::quiet_NaN()), 0);
  EXPECT_EQ(tracer::srgb8_from_linear(-std::numeric_limits<float>::quiet_NaN()), 0);
}

TEST(SrgbCode, IsTheSameForAnArrayAsForEachValue) {
  std::vector<float> row;
  for (int i = -20; i < 1100; ++i) row.push_back(static_cast<float>(i) / 1000);
  std::vector<std::uint8_t> codes(row.size());
  tracer::srgb8_from_linear(row, codes);
  for (std::size_t i = 0; i < row.size(); ++i) EXPECT_EQ(codes[i], tracer::srgb8_from_linear(row[i])) << row[i];
}

/// 16 bits, in a row of its own: no neighbor decides how it is found.
int code16(float linear) {
  std::uint16_t code = 0;
  tracer::srgb16_from_linear({&linear, 1}, {&code, 1});
  return code;
}

TEST(SrgbCode16, IsTheNearestToTheCurveForAHundredThousandFloatsSpreadOverAllScales) {
  std::mt19937 random(2);  // NOLINT: the same floats every time
  std::uniform_int_distribution<std::uint32_t> bits(0, std::bit_cast<std::uint32_t>(1.0F));
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<float> row;
  for (int i = 0; i < 50'000; ++i) row.insert(row.end(), {std::bit_cast<float>(bits(random)), unit(random)});
  std::vector<std::uint16_t> codes(row.size());
  tracer::srgb16_from_linear(row, codes);
  for (std::size_t i = 0; i < row.size(); ++i) {
    ASSERT_EQ(codes[i], nearest_code(row[i], 65535.0L)) << "linear " << std::hexfloat << row[i];
    ASSERT_EQ(code16(row[i]), codes[i]) << "linear " << std::hexfloat << row[i];
  }
}

TEST(SrgbCode16, ChangesExactlyWhereTheCurvePassesAHalf) {
  const auto middle = [](int code) {
    const long double encoded = (code - 0.5L) / 65535;
    return encoded <= 0.04045L ? encoded / 12.92L : std::pow((encoded + 0.055L) / 1.055L, 2.4L);
  };
  for (int code = 1; code <= 65535; ++code) {
    const auto nearest = std::bit_cast<std::uint32_t>(static_cast<float>(middle(code)));
    for (std::uint32_t bits = nearest - 2; bits <= nearest + 2; ++bits) {
      const auto linear = std::bit_cast<float>(bits);
      ASSERT_EQ(code16(linear), nearest_code(linear, 65535.0L)) << "linear " << std::hexfloat << linear;
    }
  }
}

TEST(SrgbCode16, IsTheSameForAnArrayAsForEachValue) {
  constexpr float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> row = {nan, -nan, infinity, -infinity, -1.0F, -0.0F, 1e-40F, 1e30F, 1.0F, 1.0000001F};
  for (int i = -20; i < 1100; ++i) row.push_back(static_cast<float>(i) / 1000);
  std::vector<std::uint16_t> codes(row.size());
  tracer::srgb16_from_linear(row, codes);
  for (std::size_t i = 0; i < row.size(); ++i) EXPECT_EQ(codes[i], tracer::srgb16_from_linear(row[i])) << row[i];
  EXPECT_EQ(codes[0], 0) << "not a number";
  EXPECT_EQ(codes[2], 65535) << "infinite";
}

TEST(SrgbCurve, AgreesWithLongDoubleToAFewUnitsInTheLastPlace) {
  for (int i = 0; i <= 100'000; ++i) {
    const double linear = i / 100'000.0;
    const auto expected = static_cast<double>(curve(linear));
    ASSERT_NEAR(tracer::srgb_from_linear(linear), expected, 1e-15) << linear;
  }
}

TEST(SrgbCurve, HasAnInverse) {
  // The standard's two pieces do not meet exactly: between their ends the round trip is off by up to 3e-8.
  for (int i = 0; i <= 100'000; ++i) {
    const double linear = i / 100'000.0;
    ASSERT_NEAR(tracer::linear_from_srgb(tracer::srgb_from_linear(linear)), linear, 1e-7) << linear;
  }
}

}  // namespace
