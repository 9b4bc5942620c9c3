#include "tracer/src/film/srgb.h"

#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>

namespace tracer {
namespace {

// Code c begins where the curve reaches (c - 1/2) / 255. A float's leading bits name a bucket so narrow (256 an octave)
// that at most one code begins in it: one look-up and one comparison replace a power, and the answer stays exact.
constexpr int mantissa_bits_dropped = 15;
constexpr std::uint32_t first_bits = std::bit_cast<std::uint32_t>(0x1p-13F);  // below: code 0
constexpr std::uint32_t last_bits = std::bit_cast<std::uint32_t>(1.0F);
constexpr std::size_t bucket_count = ((last_bits - first_bits) >> mantissa_bits_dropped) + 1;

struct Codes {
  std::array<float, 257> begin{};                   // begin[c]: the least float whose code is c
  std::array<std::uint8_t, bucket_count> lowest{};  // lowest[bucket]: the code of its first float

  Codes() {
    for (std::size_t code = 1; code < 256; ++code) {
      const double exact = linear_from_srgb((static_cast<double>(code) - 0.5) / 255);
      const auto nearest = static_cast<float>(exact);
      begin[code] = nearest < exact ? std::nextafter(nearest, 2.0F) : nearest;
    }
    begin[256] = INFINITY;  // so that 255 may be compared with what follows it
    std::size_t code = 0;
    for (std::size_t bucket = 0; bucket < bucket_count; ++bucket) {
      const auto bits = static_cast<std::uint32_t>(first_bits + (bucket << mantissa_bits_dropped));
      while (begin[code + 1] <= std::bit_cast<float>(bits)) ++code;
      lowest[bucket] = static_cast<std::uint8_t>(code);
    }
  }
};

const Codes& codes() {
  static const Codes table;
  return table;
}

std::uint8_t look_up(const Codes& table, float linear) {
  if (!(linear >= 0x1p-13F)) return 0;  // NaN too
  if (linear >= 1) return 255;
  const std::uint32_t bucket = (std::bit_cast<std::uint32_t>(linear) - first_bits) >> mantissa_bits_dropped;
  const std::uint8_t code = table.lowest[bucket];
  return static_cast<std::uint8_t>(code + (linear >= table.begin[code + std::size_t{1}] ? 1 : 0));
}

}  // namespace

double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

std::uint8_t srgb8_from_linear(float linear) { return look_up(codes(), linear); }

std::uint16_t srgb16_from_linear(float linear) {
  if (!(linear > 0)) return 0;  // NaN too
  if (linear >= 1) return 65535;
  return static_cast<std::uint16_t>(std::floor(65535 * srgb_from_linear(linear) + 0.5));
}

void srgb8_from_linear(std::span<const float> linear, std::span<std::uint8_t> into) {
  assert(linear.size() == into.size());
  const Codes& table = codes();
  for (std::size_t i = 0; i < linear.size(); ++i) into[i] = look_up(table, linear[i]);
}

}  // namespace tracer
