#pragma once
/// A rendered image: linear RGB, 32-bit float, and what else the scene's output asks for.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tracer {

/// Everything here has one element a pixel (three where said), row 0 on top, and is empty when it was not asked for.
/// Means are over the pixel's samples.
struct Layers {
  std::vector<float> depth;  ///< world, along the viewing axis; mean over the samples that hit; infinity where none did
  std::vector<float> normal;  ///< xyz, world, towards the camera; mean, 0 for samples that hit nothing
  std::vector<float> albedo;  ///< RGB, the material's color; likewise
  /// Of the first sample that hit: 1 for the first of the document's objects, and so on, each object of an instance
  /// counted by itself; 0: nothing.
  std::vector<std::uint32_t> object_id;
  std::vector<std::uint32_t> samples;  ///< how many were taken
  std::vector<float> error;            ///< estimate of the error left, in levels; root mean square of the channels
};

struct Image {
  std::uint32_t width = 0, height = 0;
  std::vector<float> rgb;      ///< width * height * 3, RGB interleaved, row 0 on top, no padding; linear, unclamped
  std::vector<float> alpha{};  ///< part of the pixel's samples that hit something, `rgb` being premultiplied by it;
                               ///< empty: all is opaque
  Layers layers{};

  [[nodiscard]] const float* pixel(std::uint32_t x, std::uint32_t y) const {
    return rgb.data() + 3 * (static_cast<std::size_t>(y) * width + x);
  }
};

}  // namespace tracer
