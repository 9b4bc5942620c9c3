#pragma once
/// Local contrast of an image: where it is not smooth.

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tracer/src/math/wide.h"

namespace tracer {

/// 8-bit code values of a row of pixels, one plane per channel.
using CodeValueRow = std::array<std::vector<float>, 3>;

/// The contrast of a pixel: its largest squared second difference over the four directions through it, summed over the
/// channels. Linear gradients have none, whatever their slope: the center of the pixel is then its mean. An edge has
/// its full height on both sides. At the border: the contrast of the nearest three pixels in a row.
///
/// If rows are requested in ascending order, the code values of each row are computed once and three rows are kept. One
/// thread.
class ContrastRows {
 public:
  /// `write_row` writes the code values of row y.
  ContrastRows(std::size_t columns, std::size_t rows, std::function<void(std::size_t y, CodeValueRow&)> write_row);

  /// Contrasts of row y; valid until the next call.
  std::span<const float> row(std::size_t y);

 private:
  const CodeValueRow& code_values(std::size_t y);

  std::size_t columns_, rows_;
  std::function<void(std::size_t, CodeValueRow&)> write_row_;
  std::array<CodeValueRow, 3> kept_;
  std::array<std::size_t, 3> kept_row_;
  std::vector<float> contrast_;
};

/// Variance predicted from the contrast for one sample of a pixel. An edge of height h at a random position in the
/// pixel gives the center sample a squared error of h^2 / 12 in the mean. A fainter contrast is more likely a curve,
/// whose center is off by 1/24 of its second difference in each direction; twice that is predicted.
WHITTLE_INLINE double predicted_variance(double contrast) {
  constexpr double edge = 3 * 6 * 6;  // six code values in each channel; smooth shading may reach that
  return contrast >= edge ? contrast / 12 : contrast / 144;
}

}  // namespace tracer
