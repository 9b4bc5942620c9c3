#include <algorithm>
#include <array>
#include <cmath>

#include "tracer/compare.h"
#include "tracer/src/compare/pixels.h"
#include "tracer/src/display/srgb.h"

namespace tracer {
namespace {

/// Color scheme of Green 2011, clipped to the sRGB gamut; codes as fractions. `fraction` is in [0,1].
std::array<double, 3> cubehelix(double fraction) {
  constexpr double start = 0.5, rotations = -1.5, hue = 1, whole_turn = 6.283185307179586;
  const double angle = whole_turn * (start / 3 + 1 + rotations * fraction);
  const double amplitude = hue * fraction * (1 - fraction) / 2;
  const double c = amplitude * std::cos(angle), s = amplitude * std::sin(angle);
  const std::array<double, 3> color{fraction - 0.14861 * c + 1.78277 * s, fraction - 0.29227 * c - 0.90649 * s,
                                    fraction + 1.97294 * c};
  return {std::clamp(color[0], 0.0, 1.0), std::clamp(color[1], 0.0, 1.0), std::clamp(color[2], 0.0, 1.0)};
}

}  // namespace

double heat_scale(const Comparison& comparison) {
  double levels = 1;
  while (levels < 256 && levels < 8 * comparison.rmse) levels *= 2;
  return levels;
}

Image heat_map(const DisplayImage& a, const DisplayImage& b, double white) {
  Image image{.width = a.width, .height = a.height, .rgb = {}};
  image.rgb.reserve(a.codes.size());
  for (std::uint32_t y = 0; y < a.height; ++y)
    for (std::uint32_t x = 0; x < a.width; ++x)
      for (const double encoded : cubehelix(std::min(1.0, greatest_difference(a, b, x, y) / (codes_per_level * white))))
        image.rgb.push_back(static_cast<float>(linear_from_srgb(encoded)));
  return image;
}

}  // namespace tracer
