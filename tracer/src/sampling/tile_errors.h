#pragma once
/// Errors of the tiles of an image. A plain ground dilutes the error of the image; the worst tile shows what looks
/// wrong.

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "tracer/scene.h"

namespace tracer {

class TileErrors {
 public:
  static constexpr std::uint32_t side = 16;

  TileErrors(std::uint32_t width, std::size_t rows)
      : width_(width),
        rows_(rows),
        columns_((width + side - 1) / side),
        sums_(columns_ * rows),
        squares_(sums_.size()) {}
  /// All rows: `variances` of all pixels.
  TileErrors(std::uint32_t width, std::size_t rows, std::span<const float> variances) : TileErrors(width, rows) {
    for (std::size_t y = 0; y < rows; ++y) add_row(y, variances.subspan(y * width, width));
  }

  /// Adds the variances of the pixels of row y. Different rows may be added concurrently, each once.
  void add_row(std::size_t y, std::span<const float> variances) {
    for (std::size_t x = 0; x < variances.size(); ++x) {
      sums_[y * columns_ + x / side] += variances[x];
      squares_[y * columns_ + x / side] += variances[x] * variances[x];
    }
  }

  /// Calls use(window, mean squared error per pixel) for each tile. The error of a tile is a sum of a few random terms:
  /// it includes 2.33 deviations of that sum, each term with the variance of the square of a normal variable.
  template <class Use>
  void each(const Use& use) const {
    constexpr double deviations = 2.33;
    for (std::size_t y = 0; y < rows_; y += side) {
      for (std::size_t column = 0; column < columns_; ++column) {
        double sum = 0, squares = 0;
        for (std::size_t row = y; row < std::min(rows_, y + side); ++row) {
          sum += sums_[row * columns_ + column];
          squares += squares_[row * columns_ + column];
        }
        const auto x = static_cast<std::uint32_t>(column) * side, top = static_cast<std::uint32_t>(y);
        const PixelWindow window{x, top, std::min(x + side, width_),
                                 static_cast<std::uint32_t>(std::min(rows_, y + side))};
        use(window, (sum + deviations * std::sqrt(2 * squares)) / static_cast<double>(window.pixels()));
      }
    }
  }

  /// The largest root mean square over the channels of a tile, in code values.
  [[nodiscard]] double worst() const {
    double worst = 0;
    each([&](const PixelWindow&, double mean) { worst = std::max(worst, mean); });
    return std::sqrt(worst / 3);
  }

 private:
  std::uint32_t width_;
  std::size_t rows_, columns_;
  std::vector<float> sums_, squares_;  ///< by row and column of tiles
};

}  // namespace tracer
