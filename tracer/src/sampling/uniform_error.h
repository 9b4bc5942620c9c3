#pragma once
/// The error of an image that has the same number of samples in every pixel, from these samples alone: no ray is
/// traced for it. It errs on the side of claiming too much.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/display/display_transform.h"
#include "tracer/src/sampling/contrast.h"

namespace tracer {

/// Such an image. What it refers to must outlive it.
struct UniformPixels {
  std::span<const float> rgb;     ///< the pixels' means, three channels each
  std::span<const float> spread;  ///< the variance of each pixel's samples, likewise; empty where there is one sample
  std::uint32_t samples = 1, width = 0;

  [[nodiscard]] std::size_t rows() const { return width > 0 ? rgb.size() / 3 / width : 0; }
};

/// Variance of every pixel's mean, in squared levels, the channels added up; row by row, best in ascending order. One
/// thread.
///
/// The samples' variance over their number is that of independent ones; stratified ones have less (Owen 1997). It is
/// joined, with the weight of two samples, by what the contrast to the neighbours lets expect: samples that agree by
/// chance, an edge having been missed, then do not count as exact.
class UniformVariance {
 public:
  /// `levels` must outlive it.
  UniformVariance(const UniformPixels& pixels, const DisplayTransform& levels);
  UniformVariance(const UniformVariance&) = delete;
  UniformVariance& operator=(const UniformVariance&) = delete;

  /// Of each pixel of row y; until the next call.
  std::span<const float> row(std::size_t y);

 private:
  [[nodiscard]] double own_variance(std::size_t pixel) const;

  UniformPixels pixels_;
  const DisplayTransform& levels_;
  ContrastRows contrasts_;
  std::vector<float> variance_;
};

}  // namespace tracer
