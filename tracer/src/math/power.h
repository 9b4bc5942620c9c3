#pragma once
/// Powers of numbers in [0,1] that vectorize, unlike std::pow. Uses only sums, products, quotients and bit operations,
/// so every instruction set gives the same result.

#include <bit>
#include <cstdint>
#include <numbers>

#include "tracer/src/math/lanes.h"

namespace tracer {

/// Value at x of the polynomial with these coefficients, highest power first (Horner's scheme).
template <class... Coefficients>
WHITTLE_INLINE double polynomial(double x, double value, Coefficients... rest) {
  ((value = value * x + rest), ...);
  return value;
}

/// log2(c) for normal c in (0,1]; 0 for 1. c = 2^e m, m in [sqrt(1/2), sqrt(2)), and log m = 2 artanh s with
/// s = (m-1)/(m+1) (Abramowitz & Stegun 1964, 4.1.27): s^2 < 0.0295, so the terms after s^21 are below 2^-60 of the
/// sum. m - 1 is exact, so logarithms near 0 keep their digits. Relative error below 2^-50.
WHITTLE_INLINE double log2_of(double c) {
  const auto bits = std::bit_cast<std::uint64_t>(c);
  constexpr std::uint64_t fraction = (std::uint64_t{1} << 52) - 1;
  const double in_1_to_2 = std::bit_cast<double>((bits & fraction) | 0x3ff0000000000000u);
  const bool high = in_1_to_2 > std::numbers::sqrt2;
  const double m = high ? in_1_to_2 * 0.5 : in_1_to_2;
  // The exponent as bits of 2^52 + exponent: before AVX-512 there is no vector conversion from 64-bit integer to
  // double.
  const double biased = std::bit_cast<double>((bits >> 52) | 0x4330000000000000u) - (0x1p52 + 1023);
  const double exponent = high ? biased + 1 : biased;
  const double s = (m - 1) / (m + 1), z = s * s;
  const double series =
      polynomial(z, 1.0 / 21, 1.0 / 19, 1.0 / 17, 1.0 / 15, 1.0 / 13, 1.0 / 11, 1.0 / 9, 1.0 / 7, 1.0 / 5, 1.0 / 3);
  const double artanh = s + s * (series * z);
  return exponent + artanh * (2 * std::numbers::log2e);
}

/// 2^y for y <= 0, 0 below 2^-1022: 2^k e^x, k whole and |x| <= log(2)/2, by the exponential series (A & S 4.2.1) up to
/// x^13, with a remainder below 2^-57. Relative error below 2^-51.
WHITTLE_INLINE double exp2_of(double y) {
  const bool vanishes = y < -1022;
  const double kept = vanishes ? 0 : y;
  constexpr double shift = 0x1.8p52;  // adding it rounds to an integer
  const double shifted = kept + shift;
  const double x = (kept - (shifted - shift)) * std::numbers::ln2;
  const double series = polynomial(x, 1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880,
                                   1.0 / 40320, 1.0 / 5040, 1.0 / 720, 1.0 / 120, 1.0 / 24, 1.0 / 6, 0.5, 1, 1);
  const double power =
      std::bit_cast<double>(std::bit_cast<std::uint64_t>(series) + (std::bit_cast<std::uint64_t>(shifted) << 52));
  return vanishes ? 0 : power;
}

/// c^n for c clamped to [0,1] and n >= 0, with 0^0 = 1; results and arguments below 2^-1022 are 0. The error of the
/// logarithm is multiplied by n: the relative error is below (2 + 8 |log2 c^n|) 2^-52, the absolute below 2^-50. NaN
/// counts as 1.
WHITTLE_INLINE double power_of(double c, double n) {
  const double at_most_1 = c < 1 ? c : 1;
  const bool vanishes = at_most_1 < 0x1p-1022;
  const double power = exp2_of(log2_of(vanishes ? 1 : at_most_1) * n);
  return vanishes ? (n > 0 ? 0 : 1) : power;
}

}  // namespace tracer
