#pragma once
/// A rendered picture: linear RGB, 32-bit float.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tracer {

struct Image {
  std::uint32_t width = 0, height = 0;
  std::vector<float> rgb;  ///< width * height * 3, RGB interleaved, row 0 on top, no padding; linear, unclamped

  [[nodiscard]] const float* pixel(std::uint32_t x, std::uint32_t y) const {
    return rgb.data() + 3 * (static_cast<std::size_t>(y) * width + x);
  }
};

}  // namespace tracer
