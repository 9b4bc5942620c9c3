#pragma once
/// Where an image is not smooth.

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tracer/src/math/wide.h"

namespace tracer {

/// The levels of a row of pixels, a plane for each channel.
using ShownRow = std::array<std::vector<float>, 3>;

/// Of every pixel the largest second difference over the four directions through it, squared, the channels added up.
/// Gradients have none, whatever their slope: the pixel's centre is then its mean. An edge has its full height on both
/// sides. At the image's border: of the nearest three pixels in a row that it has.
///
/// Row by row, for it asks each row's levels once when rows come in ascending order, and keeps three. One thread.
class ContrastRows {
 public:
  /// `show` writes the levels of a row, of as many columns as there are.
  ContrastRows(std::size_t columns, std::size_t rows, std::function<void(std::size_t y, ShownRow&)> show);

  /// Of each pixel of row y; until the next call.
  std::span<const float> row(std::size_t y);

 private:
  const ShownRow& to_display(std::size_t y);

  std::size_t columns_, rows_;
  std::function<void(std::size_t, ShownRow&)> show_;
  std::array<ShownRow, 3> kept_;
  std::array<std::size_t, 3> kept_row_;
  std::vector<float> contrast_;
};

/// The variance to expect of one sample in a pixel of that contrast, before anything was measured. An edge anywhere in
/// the pixel, of height h, puts the centre's sample off by h^2 / 12 in the mean. What is fainter is more likely a
/// curve, whose centre is off by 1/24 of its second difference in each direction; twice that is expected.
WHITTLE_INLINE double expected_variance(double contrast) {
  constexpr double edge = 3 * 6 * 6;  // six levels in each channel: below, shading bends as much
  return contrast >= edge ? contrast / 12 : contrast / 144;
}

}  // namespace tracer
