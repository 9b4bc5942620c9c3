#include "api/src/json/number.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <limits>
#include <system_error>

namespace api::json {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// A number's text taken apart: value = (-1)^negative * mantissa * 10^exponent while there are at most 19 digits.
struct Decimal {
  bool negative = false;
  std::uint64_t mantissa = 0;
  int digits = 0;  ///< significant ones, leading zeros left out
  int exponent = 0;
};

const char* read_digits(const char* at, const char* end, Decimal& decimal) {
  for (; at != end && is_digit(*at); ++at) {
    if (decimal.digits < 19) decimal.mantissa = decimal.mantissa * 10 + static_cast<std::uint64_t>(*at - '0');
    if (decimal.mantissa != 0) ++decimal.digits;
  }
  return at;
}

const char* read_exponent(const char* at, const char* end, int& exponent) {
  const bool negative = at != end && *at == '-';
  if (at != end && (*at == '-' || *at == '+')) ++at;
  if (at == end || !is_digit(*at)) return nullptr;
  int value = 0;
  for (; at != end && is_digit(*at); ++at) {
    if (value < 1'000'000) value = value * 10 + (*at - '0');
  }
  exponent += negative ? -value : value;
  return at;
}

/// Checks the grammar; null when it is broken.
const char* scan(const char* at, const char* end, Decimal& decimal) {
  if (at != end && *at == '-') {
    decimal.negative = true;
    ++at;
  }
  if (at == end || !is_digit(*at)) return nullptr;
  const char* const whole = at;
  at = read_digits(at, end, decimal);
  if (*whole == '0' && at - whole > 1) return nullptr;
  if (at != end && *at == '.') {
    const char* const fraction = ++at;
    at = read_digits(at, end, decimal);
    if (at == fraction) return nullptr;
    decimal.exponent = static_cast<int>(fraction - at);
  }
  if (at != end && (*at == 'e' || *at == 'E')) at = read_exponent(at + 1, end, decimal.exponent);
  return at;
}

constexpr std::array<double, 23> powers_of_ten = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                  1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                  1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/// Both operands exact, so one rounding: the nearest double (Clinger 1990, "How to read floating point numbers
/// accurately", the fast case). This covers nearly every number that people and programs write.
bool is_simple(const Decimal& decimal) {
  return decimal.digits <= 19 && decimal.mantissa <= (1ull << 53) && decimal.exponent >= -22 && decimal.exponent <= 22;
}

double simple(const Decimal& decimal) {
  const auto mantissa = static_cast<double>(decimal.mantissa);
  const double value =
      decimal.exponent < 0 ? mantissa / powers_of_ten[-decimal.exponent] : mantissa * powers_of_ten[decimal.exponent];
  return decimal.negative ? -value : value;
}

}  // namespace

Number read_number(const char* begin, const char* end) {
  Decimal decimal;
  const char* const after = scan(begin, end, decimal);
  if (after == nullptr) return {};
  if (is_simple(decimal)) return {simple(decimal), after};
  double value = 0;
  if (std::from_chars(begin, after, value).ec == std::errc::result_out_of_range) {
    const bool overflows = decimal.digits + decimal.exponent > 0;  // else it underflows: the two are 600 powers apart
    value = overflows ? std::numeric_limits<double>::infinity() : 0.0;
    if (decimal.negative) value = -value;
  }
  return {value, after};
}

}  // namespace api::json
