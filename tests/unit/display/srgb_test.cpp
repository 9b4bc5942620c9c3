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
template <class Code>
int nearest_code(float linear) {
  const long double clamped = linear > 0 ? std::fmin(linear, 1.0F) : 0;  // 0 for NaN too
  return static_cast<int>(std::floor(std::numeric_limits<Code>::max() * curve(clamped) + 0.5L));
}

void encode(float linear, std::uint8_t& code) { code = tracer::srgb8_from_linear(linear); }
void encode(float linear, std::uint16_t& code) { code = tracer::srgb16_from_linear(linear); }
void encode(std::span<const float> row, std::span<std::uint8_t> codes) { tracer::srgb8_from_linear(row, codes); }
void encode(std::span<const float> row, std::span<std::uint16_t> codes) { tracer::srgb16_from_linear(row, codes); }

/// Expects the nearest codes for a value, for a row, and for a row of one value: no neighbor decides how it is found.
template <class Code>
void expect_nearest(const std::vector<float>& row) {
  std::vector<Code> codes(row.size());
  encode(row, codes);
  for (std::size_t i = 0; i < row.size(); ++i) {
    Code single = 0, alone = 0;
    encode(row[i], single);
    encode({&row[i], 1}, {&alone, 1});
    ASSERT_EQ(codes[i], nearest_code<Code>(row[i])) << "linear " << std::hexfloat << row[i];
    ASSERT_EQ(alone, codes[i]) << "linear " << std::hexfloat << row[i];
    ASSERT_EQ(single, codes[i]) << "linear " << std::hexfloat << row[i];
  }
}

TEST(SrgbCode, IsTheNearestToTheCurveForAHundredThousandFloatsSpreadOverAllScales) {
  std::mt19937 random(1);  // NOLINT: the same floats every time
  std::uniform_int_distribution<std::uint32_t> bits(0, std::bit_cast<std::uint32_t>(1.0F));
  std::uniform_real_distribution<float> unit(0, 1);
  constexpr float infinity = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> row = {nan,   -nan,   infinity, -infinity,  -1e30F, -1.0F, -1e-30F,
                            -0.0F, 1e-40F, 1.0F,     1.0000001F, 7.0F,   1e30F};
  for (int i = -20; i < 1100; ++i) row.push_back(static_cast<float>(i) / 1000);
  for (int i = 0; i < 50'000; ++i) row.insert(row.end(), {std::bit_cast<float>(bits(random)), unit(random)});
  expect_nearest<std::uint8_t>(row);
  expect_nearest<std::uint16_t>(row);
}

/// The floats around the places where the curve is half-way between two codes.
template <class Code>
std::vector<float> floats_at_halves() {
  std::vector<float> row;
  for (int code = 1; code <= std::numeric_limits<Code>::max(); ++code) {
    const long double encoded = (code - 0.5L) / std::numeric_limits<Code>::max();
    const long double middle = encoded <= 0.04045L ? encoded / 12.92L : std::pow((encoded + 0.055L) / 1.055L, 2.4L);
    const auto nearest = std::bit_cast<std::uint32_t>(static_cast<float>(middle));
    for (std::uint32_t bits = nearest - 2; bits <= nearest + 2; ++bits) row.push_back(std::bit_cast<float>(bits));
  }
  return row;
}

TEST(SrgbCode, ChangesExactlyWhereTheCurvePassesAHalf) {
  expect_nearest<std::uint8_t>(floats_at_halves<std::uint8_t>());
  expect_nearest<std::uint16_t>(floats_at_halves<std::uint16_t>());
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
