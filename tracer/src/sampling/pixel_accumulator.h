#pragma once
/// From the samples of a pixel to its place in the image.

#include <algorithm>
#include <limits>

#include "tracer/image.h"
#include "tracer/src/interaction/gbuffer.h"

namespace tracer {

/// Makes room in `image` for the image and what `output` asks for beside it, all zero.
void allocate(Image& image, const PixelWindow& window, const Output& output);

/// The film holds floats: what is brighter than the largest is that one, never infinite.
inline float film_value(double value) {
  return static_cast<float>(std::min<double>(value, std::numeric_limits<float>::max()));
}

/// Sum of one pixel's finite samples.
class PixelAccumulator {
 public:
  void add(const Color& radiance) {
    sum_ += radiance;
    ++count_;
  }
  /// Means, into three channels. In line: it is most of what an image of one sample a pixel needs beside its rays.
  void write(float* rgb) const {
    const Color mean = count_ > 0 ? sum_ * (1.0 / count_) : Color{};
    rgb[0] = film_value(mean.r);
    rgb[1] = film_value(mean.g);
    rgb[2] = film_value(mean.b);
  }
  /// The variance of the samples, whose squares sum up to `squares`, into three channels.
  void write_spread(const Color& squares, float* spread) const;

 private:
  Color sum_;
  std::uint32_t count_ = 0;
};

/// The same of what the samples' camera rays hit.
class LayerAccumulator {
 public:
  void add(const GBuffer& hits, std::size_t sample);
  /// Means, into those of the layers that `image` has room for.
  void write(Image& image, std::size_t index) const;

 private:
  std::uint32_t count_ = 0, hit_count_ = 0, object_id_ = 0;
  double depth_ = 0;
  Vec3 normal_;
  Color albedo_;
};

}  // namespace tracer
