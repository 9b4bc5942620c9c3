#pragma once
/// A rendered image: linear RGB, 32-bit float, and the layers that the scene's output requests.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tracer {

/// Values at the first hit of camera rays. Row 0 on top, no padding; empty if not requested. Means are over the pixel's
/// samples.
struct Layers {
  std::vector<float> depth;  ///< 1 per pixel; world, along the viewing axis; mean over hits, infinity without any
  /// 3 per pixel; world space, on the camera's side; mean, samples without a hit count as 0.
  std::vector<float> normal;
  std::vector<float> albedo;  ///< 3 per pixel; RGB of the material's color; mean, samples without a hit count as 0
  /// 1 per pixel; object of the first sample that hit, counted from 1 in document order with each object of an instance
  /// counted separately; 0: no hit.
  std::vector<std::uint32_t> object_id;
  std::vector<std::uint32_t> samples;  ///< 1 per pixel; number of samples
  std::vector<float> error;            ///< 1 per pixel; error estimate in levels, root mean square of the channels
};

struct Image {
  std::uint32_t width = 0, height = 0;
  std::vector<float> rgb;      ///< width * height * 3, RGB interleaved, row 0 on top, no padding; linear, unclamped
  std::vector<float> alpha{};  ///< 1 per pixel; share of samples that hit, `rgb` is premultiplied; empty: opaque
  Layers layers{};

  [[nodiscard]] const float* pixel(std::uint32_t x, std::uint32_t y) const {
    return rgb.data() + 3 * (static_cast<std::size_t>(y) * width + x);
  }
};

}  // namespace tracer
