#include "tracer/src/display/srgb.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "tracer/src/math/wide.h"

namespace tracer {
namespace {

// Code c begins where the curve reaches (c - 1/2) / 255. A float's leading bits select a bucket so narrow (256 per
// octave) that at most one code begins in it: one table access and one comparison replace a power, exactly.
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
    begin[256] = INFINITY;  // sentinel after code 255
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

// 16 bits have too many codes for such a table. There the power 5/12 is that of the float's exponent, from a table,
// times that of its mantissa, from the binomial series about the center of the octave, with a truncation error below
// 4e-5 codes. Values whose code depends on that error are recomputed with the exact power.
constexpr int series_degree = 14;
constexpr double error_bound = 1e-4;    // codes from where the next begins
constexpr std::size_t block_size = 64;  // numbers; one in 5000 is ambiguous
constexpr int curve_exponent_min = -9;  // of 0.0031308, where the power begins
constexpr double code_max = 65535;

struct Series {
  double term[series_degree + 1];         // of (1.5 + t)^(5/12)
  double octave[1 - curve_exponent_min];  // the curve's factor times 2^(5/12 exponent), in codes

  Series() {
    term[0] = std::pow(1.5, 5.0 / 12);
    for (int k = 1; k <= series_degree; ++k) term[k] = term[k - 1] * (5.0 / 12 - (k - 1)) / (k * 1.5);
    for (int exponent = curve_exponent_min; exponent <= 0; ++exponent)
      octave[exponent - curve_exponent_min] = code_max * 1.055 * std::exp2(5.0 / 12 * exponent);
  }
};

const Series& series() {
  static const Series all;
  return all;
}

/// Computes the codes of the numbers; returns how many of them are ambiguous.
WHITTLE_WIDE int encode_wide(const Series& s, const float* linear, std::size_t count, std::uint16_t* __restrict codes) {
  const double* const octave = s.octave;  // a member access would prevent vectorization of the loop
  int ambiguous = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float positive = linear[i] > 0 ? linear[i] : 0;  // NaN too
    const float x = positive < 1 ? positive : 1;
    const auto bits = std::bit_cast<std::int32_t>(x);
    const int exponent = (bits >> 23) - 127 - curve_exponent_min;
    const double t = static_cast<double>(std::bit_cast<float>((bits & 0x7fffff) | 0x3f800000)) - 1.5;
    double power = s.term[series_degree];
    for (int k = series_degree - 1; k >= 0; --k) power = power * t + s.term[k];
    const double curved = octave[exponent > 0 ? exponent : 0] * power - code_max * 0.055;
    const double code = (static_cast<double>(x) <= 0.0031308 ? code_max * 12.92 * x : curved) + 0.5;
    const int whole = static_cast<int>(code);
    const double part = code - whole;
    ambiguous += part < error_bound || part > 1 - error_bound ? 1 : 0;
    codes[i] = static_cast<std::uint16_t>(whole);
  }
  return ambiguous;
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

void srgb16_from_linear(std::span<const float> linear, std::span<std::uint16_t> into) {
  assert(linear.size() == into.size());
  const Series& table = series();
  for (std::size_t first = 0; first < linear.size(); first += block_size) {
    const auto some = linear.subspan(first, std::min(block_size, linear.size() - first));
    if (encode_wide(table, some.data(), some.size(), into.data() + first) == 0) continue;
    for (std::size_t i = 0; i < some.size(); ++i) into[first + i] = srgb16_from_linear(some[i]);
  }
}

}  // namespace tracer
