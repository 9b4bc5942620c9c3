#include "tracer/src/display/srgb.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace tracer {
namespace {

/// Codes of floats. Code c begins where the curve reaches (c - 1/2) / code_max. A float's leading bits select a bucket
/// so narrow that at most one code begins in it: one table access and one comparison replace a power, exactly.
/// `dropped` bits of the mantissa are ignored; below 2^`exponent` is code 0.
template <class Code, int exponent, int dropped>
class CodeTable {
 public:
  CodeTable() : begin_(code_max + 2), lowest_(bucket_of(1.0F)) {
    for (std::size_t code = 1; code <= code_max; ++code) {
      const double exact = linear_from_srgb((static_cast<double>(code) - 0.5) / code_max);
      const auto nearest = static_cast<float>(exact);
      begin_[code] = nearest < exact ? std::nextafter(nearest, 2.0F) : nearest;
    }
    begin_[code_max + 1] = INFINITY;  // sentinel
    std::size_t code = 0;
    for (std::size_t bucket = 0; bucket < lowest_.size(); ++bucket) {
      const auto bits = static_cast<std::uint32_t>(first_bits + (bucket << dropped));
      while (begin_[code + 1] <= std::bit_cast<float>(bits)) ++code;
      lowest_[bucket] = static_cast<Code>(code);
    }
  }

  [[nodiscard]] Code at(float linear) const {
    if (!(linear >= first)) return 0;  // NaN too
    if (linear >= 1) return code_max;
    const Code code = lowest_[bucket_of(linear)];
    return static_cast<Code>(code + (linear >= begin_[code + std::size_t{1}] ? 1 : 0));
  }

 private:
  static constexpr Code code_max = std::numeric_limits<Code>::max();
  static constexpr std::uint32_t first_bits = static_cast<std::uint32_t>(127 + exponent) << 23U;
  static constexpr float first = std::bit_cast<float>(first_bits);

  static constexpr std::size_t bucket_of(float linear) {
    return (std::bit_cast<std::uint32_t>(linear) - first_bits) >> dropped;
  }

  std::vector<float> begin_;  ///< begin_[c]: the least float whose code is c
  std::vector<Code> lowest_;  ///< lowest_[bucket]: the code of its first float
};

const auto& codes8() {
  static const CodeTable<std::uint8_t, -13, 15> table;
  return table;
}

const auto& codes16() {
  static const CodeTable<std::uint16_t, -21, 8> table;  // 2 MB, computed in milliseconds
  return table;
}

template <class Table, class Code>
void encode(const Table& table, std::span<const float> linear, std::span<Code> into) {
  assert(linear.size() == into.size());
  std::transform(linear.begin(), linear.end(), into.begin(), [&](float value) { return table.at(value); });
}

}  // namespace

double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

std::uint8_t srgb8_from_linear(float linear) { return codes8().at(linear); }
std::uint16_t srgb16_from_linear(float linear) { return codes16().at(linear); }

void srgb8_from_linear(std::span<const float> linear, std::span<std::uint8_t> codes) {
  encode(codes8(), linear, codes);
}
void srgb16_from_linear(std::span<const float> linear, std::span<std::uint16_t> codes) {
  encode(codes16(), linear, codes);
}

}  // namespace tracer
