#pragma once
/// Difference of one pixel of two images of equal size, in codes.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "tracer/compare.h"

namespace tracer {

inline double code_at(const DisplayImage& image, std::uint32_t x, std::uint32_t y, std::size_t channel) {
  return image.codes[3 * (static_cast<std::size_t>(y) * image.width + x) + channel];
}

/// Maximum over the three channels.
inline double greatest_difference(const DisplayImage& a, const DisplayImage& b, std::uint32_t x, std::uint32_t y) {
  double greatest = 0;
  for (std::size_t channel = 0; channel < 3; ++channel)
    greatest = std::max(greatest, std::abs(code_at(a, x, y, channel) - code_at(b, x, y, channel)));
  return greatest;
}

}  // namespace tracer
