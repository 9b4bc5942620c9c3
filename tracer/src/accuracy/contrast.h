#pragma once
/// Where a picture is not smooth.

#include <cstdint>
#include <span>
#include <vector>

namespace tracer {

/// Of every pixel of a picture `width` pixels wide, `shown` being its levels, three a pixel: the largest second
/// difference over the four directions through the pixel, squared, the channels added up. Gradients have none, whatever
/// their slope: the pixel's centre is then its mean. An edge has its full height on both sides.
std::vector<float> contrasts(std::span<const float> shown, std::uint32_t width);

/// The same, pixel by pixel. `shown` must outlive it. Any thread.
class Contrasts {
 public:
  Contrasts(std::span<const float> shown, std::uint32_t width)
      : shown_(shown), columns_(width), rows_(static_cast<std::int64_t>(shown.size() / 3) / columns_) {}
  [[nodiscard]] float at(std::size_t x, std::size_t y) const;

 private:
  std::span<const float> shown_;
  std::int64_t columns_, rows_;
};

/// The variance to expect of one sample in a pixel of that contrast, before anything was measured. An edge anywhere in
/// the pixel, of height h, puts the centre's sample off by h^2 / 12 in the mean. What is fainter is more likely a
/// curve, whose centre is off by 1/24 of its second difference in each direction; twice that is expected.
double expected_variance(double contrast);

}  // namespace tracer
