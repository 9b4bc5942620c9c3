#pragma once
/// Error of an image with equally many samples per pixel, estimated from these samples alone without further rays. It
/// rather overestimates.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/display/display_transform.h"
#include "tracer/src/sampling/contrast.h"

namespace tracer {

/// References must outlive it.
struct UniformPixels {
  std::span<const float> rgb;       ///< means, three channels per pixel
  std::span<const float> variance;  ///< variances of each pixel's samples, three channels; empty for one sample
  std::uint32_t samples = 1, width = 0;

  [[nodiscard]] std::size_t rows() const { return width > 0 ? rgb.size() / 3 / width : 0; }
};

/// Variance of every pixel's mean, in squared code values, summed over the channels; row by row, best in ascending
/// order. One thread.
///
/// The variance of the samples divided by their number is that of independent samples; stratified ones have less (Owen
/// 1997). The prediction from the contrast is added with the weight of two samples, so that samples that agree by
/// chance, because all missed an edge, do not count as exact.
class UniformVariance {
 public:
  /// `display` must outlive it.
  UniformVariance(const UniformPixels& pixels, const DisplayTransform& display);
  UniformVariance(const UniformVariance&) = delete;
  UniformVariance& operator=(const UniformVariance&) = delete;

  /// Variances of row y; valid until the next call.
  std::span<const float> row(std::size_t y);

 private:
  [[nodiscard]] double sample_variance(std::size_t pixel) const;

  UniformPixels pixels_;
  const DisplayTransform& display_;
  ContrastRows contrasts_;
  std::vector<float> variance_;
};

}  // namespace tracer
