#pragma once
/// Two-dimensional gradient noise.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "tracer/src/math/sampling.h"

namespace tracer {

/// Contribution of a lattice point: its gradient, one of eight unit directions chosen by a hash of the coordinates'
/// bits (so no coordinate is too large), times the offset (x, y).
inline double lattice_slope(double i, double j, double x, double y) {
  const auto bits = [](double whole) { return std::bit_cast<std::uint64_t>(whole + 0.0); };  // -0 is 0
  const double diagonal = std::numbers::sqrt2 / 2;
  switch (mix(bits(i) ^ mix(bits(j))) >> 61) {
    case 0:
      return x;
    case 1:
      return -x;
    case 2:
      return y;
    case 3:
      return -y;
    case 4:
      return (x + y) * diagonal;
    case 5:
      return (x - y) * diagonal;
    case 6:
      return (y - x) * diagonal;
    default:
      return (-x - y) * diagonal;
  }
}

/// Noise in [-1, 1], 0 at integer coordinates, with continuous second derivatives: gradients of the four surrounding
/// lattice points, blended by 6t^5 - 15t^4 + 10t^3 (Perlin 2002, "Improving Noise"). Scaled by sqrt(2), because unit
/// gradients reach sqrt(1/2) in two dimensions.
inline double gradient_noise(double x, double y) {
  const double i = std::floor(x), j = std::floor(y);
  const double u = x - i, v = y - j;
  const auto fade = [](double t) { return t * t * t * (t * (t * 6 - 15) + 10); };
  const double low = std::lerp(lattice_slope(i, j, u, v), lattice_slope(i + 1, j, u - 1, v), fade(u));
  const double high = std::lerp(lattice_slope(i, j + 1, u, v - 1), lattice_slope(i + 1, j + 1, u - 1, v - 1), fade(u));
  return std::numbers::sqrt2 * std::lerp(low, high, fade(v));
}

/// Sum of `octaves` over the sum of their amplitudes, in [-1, 1]. An octave whose cells are not much larger than
/// `width` has a mean near 0 over it: it fades out between a fifth and three quarters of a cell (Apodaca, Gritz 2000,
/// Advanced RenderMan, sec. 11.3).
inline double octave_noise(double x, double y, std::uint32_t octaves, double width) {
  double sum = 0, amplitudes = 0, amplitude = 1;
  for (std::uint32_t octave = 0; octave < octaves; ++octave, amplitude /= 2, x *= 2, y *= 2, width *= 2) {
    amplitudes += amplitude;
    const double t = std::clamp((width - 0.2) / 0.55, 0.0, 1.0);
    const double left = 1 - t * t * (3 - 2 * t);
    if (left > 0) sum += amplitude * left * gradient_noise(x, y);
  }
  return sum / amplitudes;
}

}  // namespace tracer
