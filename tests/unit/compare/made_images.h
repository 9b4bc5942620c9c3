#pragma once
/// Synthetic images with known values.

#include <cstdint>
#include <functional>
#include <random>

#include "tracer/compare.h"

namespace tracer {

/// `levels(x, y, channel)` for each value.
inline DisplayImage made(std::uint32_t width, std::uint32_t height,
                         const std::function<double(std::uint32_t, std::uint32_t, int)>& levels) {
  DisplayImage image{width, height, {}};
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x)
      for (int channel = 0; channel < 3; ++channel)
        image.codes.push_back(static_cast<float>(levels(x, y, channel) * codes_per_level));
  return image;
}

inline DisplayImage constant(double levels, std::uint32_t width = 16, std::uint32_t height = 12) {
  return made(width, height, [levels](auto, auto, auto) { return levels; });
}

/// Whole levels, each as likely as the other.
inline DisplayImage noise(std::uint32_t width, std::uint32_t height, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> level(0, 255);
  return made(width, height, [&](auto, auto, auto) { return level(random); });
}

}  // namespace tracer
