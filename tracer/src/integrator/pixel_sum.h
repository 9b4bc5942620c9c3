#pragma once
/// From the samples of a pixel to its place in the picture.

#include "tracer/image.h"
#include "tracer/src/integrator/first_hits.h"

namespace tracer {

/// Makes room in `image` for the picture and what `output` asks for beside it, all zero.
void allocate(Image& image, const PixelWindow& window, const Output& output);

/// The film holds floats: what is brighter than the largest is that one, never infinite.
float film_value(double value);

/// One pixel's mean, into the pixel `index` of the picture.
void write_color(Image& image, std::size_t index, const Color& mean);

/// Sum of one pixel's finite samples.
class PixelSum {
 public:
  void add(const Color& radiance) {
    sum_ += radiance;
    ++count_;
  }
  /// Means, into the pixel `index` of the picture.
  void write(Image& image, std::size_t index) const;
  /// The variance of the samples, whose squares sum up to `squares`, into three channels.
  void write_spread(const Color& squares, float* spread) const;

 private:
  Color sum_;
  std::uint32_t count_ = 0;
};

/// The same of what the samples' camera rays hit.
class LayerSum {
 public:
  void add(const FirstHits& hits, std::size_t sample);
  /// Means, into those of the layers that `image` has room for.
  void write(Image& image, std::size_t index) const;

 private:
  std::uint32_t count_ = 0, hit_count_ = 0, object_id_ = 0;
  double depth_ = 0;
  Vec3 normal_;
  Color albedo_;
};

}  // namespace tracer
