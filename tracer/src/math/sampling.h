#pragma once
/// Sample positions from a hash of (pixel, sample, seed): stateless, so the image does not depend on the scheduling.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>

#include "tracer/scene.h"

namespace tracer {

constexpr std::uint32_t reverse_bits(std::uint32_t x) {
  x = (x << 16) | (x >> 16);
  x = ((x & 0x00ff00ffu) << 8) | ((x & 0xff00ff00u) >> 8);
  x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
  x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
  return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
}

/// Mixes 64 bits (finalizer of splitmix64: Steele, Lea, Flood 2014).
constexpr std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// Owen scrambling of a 32-bit fraction: each bit is flipped by a hash of the bits above it
/// (Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4); hash of Laine & Karras 2011).
constexpr std::uint32_t owen_scrambled_reverse(std::uint32_t reversed, std::uint32_t seed) {
  std::uint32_t x = reversed;
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  x ^= x * 0x53a22864u;
  return reverse_bits(x);
}
constexpr std::uint32_t owen_scrambled(std::uint32_t x, std::uint32_t seed) {
  return owen_scrambled_reverse(reverse_bits(x), seed);
}

/// Second dimension of Sobol's sequence, bits reversed (the first is the index itself). Together they are a
/// (0,2)-sequence: every aligned 2^m points fall one into each elementary interval (Sobol 1967; Kollig & Keller 2002,
/// fig. 4). The generator matrix is Pascal's triangle modulo 2: bit i is the sum of the bits whose numbers contain the
/// bits of the number i.
constexpr std::uint32_t sobol_second_reverse(std::uint32_t index) {
  index ^= (index >> 1) & 0x55555555u;
  index ^= (index >> 2) & 0x33333333u;
  index ^= (index >> 4) & 0x0f0f0f0fu;
  index ^= (index >> 8) & 0x00ff00ffu;
  return index ^ (index >> 16);
}

/// Point `index` of the Owen-scrambled (0,2)-sequence of `key`, in [0,1)^2. Any first n points are stratified.
inline Vec2 sequence_point(std::uint32_t index, std::uint64_t key) {
  const std::uint32_t x = owen_scrambled_reverse(index, static_cast<std::uint32_t>(key));
  const std::uint32_t y = owen_scrambled_reverse(sobol_second_reverse(index), static_cast<std::uint32_t>(key >> 32));
  return {x * 0x1p-32, y * 0x1p-32};
}

/// The same points in a scrambled order: two sequences with equal indices would be dependent in every bit, even with
/// different Owen scrambling. Aligned blocks of 2^m indices stay blocks, so they stay stratified (Burley 2020, sec. 3).
inline Vec2 shuffled_point(std::uint32_t index, std::uint64_t key) {
  return sequence_point(owen_scrambled(index, static_cast<std::uint32_t>(mix(key))), key);
}

/// Point of the unit circle at the angle 2 pi `turn`, within 3e-16, for `turn` in [0,1]: Taylor polynomials about the
/// nearest quarter turn, which vectorize.
inline Vec2 point_of_circle(double turn) {
  const double quarter = std::floor(4 * turn + 0.5), x = (4 * turn - quarter) * (std::numbers::pi / 2), z = x * x;
  double sine = -1 / 1307674368000.0, cosine = 1 / 20922789888000.0;
  for (const double term : {1 / 6227020800.0, -1 / 39916800.0, 1 / 362880.0, -1 / 5040.0, 1 / 120.0, -1 / 6.0, 1.0})
    sine = sine * z + term;
  for (const double term :
       {-1 / 87178291200.0, 1 / 479001600.0, -1 / 3628800.0, 1 / 40320.0, -1 / 720.0, 1 / 24.0, -0.5, 1.0})
    cosine = cosine * z + term;
  sine *= x;
  const bool first = quarter == 1, second = quarter == 2, third = quarter == 3;
  const double across = first | third ? sine : cosine, along = first | third ? cosine : sine;
  return {first | second ? -across : across, second | third ? -along : along};
}

/// Unit direction around z, distributed as its cosine to z: a point of the unit disc, projected up (Malley 1988).
inline Vec3 cosine_direction(const Vec2& xi) {
  const double radius = std::sqrt(xi.x);
  const Vec2 at = point_of_circle(xi.y);
  return {radius * at.x, radius * at.y, std::sqrt(1 - xi.x)};
}

/// One of several intervals that lie side by side.
struct Selected {
  std::size_t index = 0;
  double position = 0;     ///< in the interval, in [0,1]: uniform if the selecting number is
  double probability = 0;  ///< length of the interval over that of all
};

/// The interval that contains the part `xi` of all, for xi in [0,1). `ends`: where each ends; the first begins at 0.
/// `guide`: of guide_selection(), or none. Precondition: the last end is positive.
inline Selected select_interval(std::span<const double> ends, double xi, std::span<const std::uint16_t> guide = {}) {
  const double wanted = xi * ends.back();
  auto found = ends.begin();
  if (guide.empty()) {
    found = std::min(std::upper_bound(ends.begin(), ends.end(), wanted), ends.end() - 1);
  } else {
    found += guide[static_cast<std::size_t>(xi * static_cast<double>(guide.size()))];
    while (*found <= wanted && found != ends.end() - 1) ++found;
  }
  const double before = found == ends.begin() ? 0 : *(found - 1);
  return {static_cast<std::size_t>(found - ends.begin()), std::clamp((wanted - before) / (*found - before), 0.0, 1.0),
          (*found - before) / ends.back()};
}

/// Sets where select_interval() begins to search, so that it takes a step or two: the interval at the beginning of each
/// of as many equal parts of all as `guide` has (Chen & Asau 1974, "On Generating Random Variates from an Empirical
/// Distribution"). Precondition: fewer than 2^16 intervals.
inline void guide_selection(std::span<const double> ends, std::span<std::uint16_t> guide) {
  std::size_t interval = 0;
  for (std::size_t part = 0; part < guide.size(); ++part) {
    const double begin = static_cast<double>(part) / static_cast<double>(guide.size()) * ends.back();
    while (interval + 1 < ends.size() && ends[interval] <= begin) ++interval;
    guide[part] = static_cast<std::uint16_t>(interval);
  }
}

/// Hash key from which all random numbers of a pixel are derived.
inline std::uint64_t pixel_key(std::uint64_t pixel, std::uint64_t seed) { return mix(pixel ^ mix(seed)); }

/// Position of sample `index` of `count` in its pixel's unit square, in [0,1)^2. A single sample is at the center; more
/// are the first `count` points of the pixel's sequence, so a larger count contains the points of a smaller one.
inline Vec2 pixel_sample(std::uint64_t key_of_pixel, std::uint32_t index, std::uint32_t count) {
  return count == 1 ? Vec2{0.5, 0.5} : sequence_point(index, key_of_pixel);
}
inline Vec2 pixel_sample(std::uint64_t pixel, std::uint32_t index, std::uint32_t count, std::uint64_t seed) {
  return pixel_sample(pixel_key(pixel, seed), index, count);
}

/// Point of the lens for the same sample, in [0,1)^2: the center for a single sample. The order is scrambled (Burley
/// 2020, sec. 3), so that the positions in the pixel and on the lens are independent.
inline Vec2 lens_sample(std::uint64_t key_of_pixel, std::uint32_t index, std::uint32_t count) {
  if (count == 1) return {0.5, 0.5};
  return shuffled_point(index, mix(key_of_pixel ^ mix(0)));  // 0 is the lens; lights use numbers from 1
}

}  // namespace tracer
