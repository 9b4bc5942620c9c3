#pragma once
/// Colors of numbers.

#include <algorithm>
#include <array>
#include <cmath>

namespace tracer {

/// Color scheme of Green 2011 (compare.h), clipped to the sRGB gamut; codes as fractions. `fraction` is in [0,1].
inline std::array<double, 3> cubehelix(double fraction) {
  constexpr double start = 0.5, rotations = -1.5, hue = 1, whole_turn = 6.283185307179586;
  const double angle = whole_turn * (start / 3 + 1 + rotations * fraction);
  const double amplitude = hue * fraction * (1 - fraction) / 2;
  const double c = amplitude * std::cos(angle), s = amplitude * std::sin(angle);
  const std::array<double, 3> color{fraction - 0.14861 * c + 1.78277 * s, fraction - 0.29227 * c - 0.90649 * s,
                                    fraction + 1.97294 * c};
  return {std::clamp(color[0], 0.0, 1.0), std::clamp(color[1], 0.0, 1.0), std::clamp(color[2], 0.0, 1.0)};
}

}  // namespace tracer
