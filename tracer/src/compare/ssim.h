#pragma once
/// Structural similarity of two images; see Comparison::ssim.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "tracer/compare.h"

namespace tracer {

/// A channel of a pixel, in codes.
inline double code_at(const DisplayImage& image, std::uint32_t x, std::uint32_t y, std::size_t channel) {
  return image.codes[3 * (static_cast<std::size_t>(y) * image.width + x) + channel];
}

/// Allocates memory for a few rows only. Precondition: equal sizes.
std::optional<double> structural_similarity(const DisplayImage& a, const DisplayImage& b);

}  // namespace tracer
