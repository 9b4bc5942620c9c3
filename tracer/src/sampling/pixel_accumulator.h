#pragma once
/// Accumulates the samples of a pixel and writes their means to the image.

#include <algorithm>
#include <limits>

#include "tracer/image.h"
#include "tracer/src/integrators/tracer_concept.h"

namespace tracer {

/// Allocates the image and the layers of `output`, all zero.
void allocate(Image& image, const PixelWindow& window, const Output& output);

/// Converts to the film's float; larger values become the largest finite one.
inline float film_value(double value) {
  return static_cast<float>(std::min<double>(value, std::numeric_limits<float>::max()));
}

/// Writes three channels.
inline void write_color(float* rgb, const Color& color) {
  rgb[0] = film_value(color.r);
  rgb[1] = film_value(color.g);
  rgb[2] = film_value(color.b);
}

/// Sum of one pixel's finite samples.
class PixelAccumulator {
 public:
  void add(const Color& radiance) {
    sum_ += radiance;
    ++count_;
  }
  /// Writes the mean to three channels.
  void write(float* rgb) const { write_color(rgb, count_ > 0 ? sum_ * (1.0 / count_) : Color{}); }
  /// Writes the variance of the samples to three channels; `squares` is the sum of their squares.
  void write_variance(const Color& squares, float* variance) const;

 private:
  Color sum_;
  std::uint32_t count_ = 0;
};

/// Sums of the first hits of one pixel's samples.
class LayerAccumulator {
 public:
  void add(const GBuffer& gbuffer, std::size_t sample);
  /// Writes the means to the layers of `image`.
  void write(Image& image, std::size_t index) const;

 private:
  std::uint32_t count_ = 0, hit_count_ = 0, object_id_ = 0;
  double depth_ = 0;
  Vec3 normal_;
  Color albedo_;
};

}  // namespace tracer
