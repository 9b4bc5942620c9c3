// Powers of numbers in [0,1] compared with long double, within the documented error.
#include "tracer/src/math/power.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/effort.h"
#include "tests/support/random.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;

constexpr Real smallest = std::numeric_limits<double>::min();

TEST(Power, IsWithinItsStatedErrorForEveryBaseAndExponent) {
  Random random(1);
  std::uint64_t normal = 0;
  for (std::uint64_t i = 0; i < effort::cases(300'000); ++i) {
    const double c = random.chance(0.5)   ? random.in(0, 1)
                     : random.chance(0.5) ? random.spread(1e-307, 1)
                                          : 1 - random.spread(1e-16, 1);
    const double n = random.chance(0.5) ? random.in(0, 100) : random.spread(1e-3, 1e308);
    const Real log2 = std::log2(Real(c)) * n, expected = std::pow(Real(c), Real(n));
    const Real error = std::fabs(power_of(c, n) - expected);
    ASSERT_LE(error, 0x1p-50L) << c << "^" << n;
    ASSERT_LE(error, (2 + 8 * std::fabs(log2)) * 0x1p-52L * expected + smallest) << c << "^" << n;
    normal += expected > smallest ? 1 : 0;
  }
  EXPECT_GT(normal, effort::cases(300'000) / 4) << "most exponents are huge, not all";
}

/// Boundaries of the logarithm's reduction: at sqrt(2) and at powers of two, an ulp to each side.
TEST(Power, IsWithinItsErrorAtTheBoundariesOfItsSeries) {
  for (const double seam : {0.5, std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 4, 0.25, 0x1p-1021, 1.0})
    for (const double c : {std::nextafter(seam, 0.0), seam, std::nextafter(seam, 1.0)})
      for (const double n : {0.5, 1.0, 2.0, 31.5, 1e6}) {
        const Real expected = std::pow(Real(c), Real(n));
        const Real bound = (2 + 8 * std::fabs(std::log2(Real(c)) * n)) * 0x1p-52L * expected + smallest;
        EXPECT_LE(std::fabs(power_of(c, n) - expected), bound) << c << "^" << n;
      }
}

TEST(Power, HasItsLimits) {
  EXPECT_EQ(power_of(0, 0), 1) << "0^0";
  EXPECT_EQ(power_of(-0.5, 0), 1);
  EXPECT_EQ(power_of(0, 1e-300), 0);
  EXPECT_EQ(power_of(-0.5, 2), 0) << "clamped, not squared";
  EXPECT_EQ(power_of(1, 1e308), 1);
  EXPECT_EQ(power_of(1 + 1e-15, 1e308), 1) << "a cosine that rounding put above one";
  EXPECT_EQ(power_of(1 - 1e-15, 1e308), 0);
  EXPECT_EQ(power_of(0.7, 0), 1);
  EXPECT_EQ(power_of(0.5, 3), 0.125);
  EXPECT_EQ(power_of(0.5, 1022), 0x1p-1022);
  EXPECT_EQ(power_of(0.5, 1023), 0) << "smaller than any normal number";
  EXPECT_EQ(power_of(0x1p-1074, 0.5), 0) << "as is what it is asked for";
  EXPECT_EQ(power_of(std::numeric_limits<double>::quiet_NaN(), 2), 1);
}

}  // namespace
}  // namespace tracer
