#pragma once
/// Tiles of the image, each traced by one thread.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "tracer/scene.h"

namespace tracer {

struct Pixel {
  std::uint32_t x, y;
};

class Tiles {
 public:
  explicit Tiles(const PixelWindow& window)
      : window_(window),
        width_(std::max(1u, window.width())),
        columns_((window.width() + side - 1) / side),
        rows_((window.height() + side - 1) / side) {}

  [[nodiscard]] std::uint64_t count() const { return std::uint64_t{columns_} * rows_; }

  /// Pixels of the full image, in blocks of 4 x 4, so that a packet of 16 camera rays covers a square.
  [[nodiscard]] std::vector<Pixel> pixels(std::uint64_t index) const {
    const auto [x0, y0, x1, y1] = tile(index);
    std::vector<Pixel> pixels(static_cast<std::size_t>(x1 - x0) * (y1 - y0));
    Pixel* next = pixels.data();
    for (std::uint32_t by = y0; by < y1; by += 4)
      for (std::uint32_t bx = x0; bx < x1; bx += 4)
        for (std::uint32_t y = by, bottom = std::min(by + 4, y1); y < bottom; ++y)
          for (std::uint32_t x = bx, right = std::min(bx + 4, x1); x < right; ++x) *next++ = {x, y};
    return pixels;
  }

  static constexpr std::uint32_t side = 32;

  /// Place of the tile's first pixel.
  [[nodiscard]] std::size_t first_place(std::uint64_t index) const {
    const PixelWindow window = tile(index);
    return place({window.x0, window.y0});
  }

  /// Tile of the pixel.
  [[nodiscard]] std::uint64_t index(const Pixel& pixel) const {
    return std::uint64_t{(pixel.y - window_.y0) / side} * columns_ + (pixel.x - window_.x0) / side;
  }

  /// A place is the index of a pixel in the window, row by row.
  [[nodiscard]] Pixel pixel(std::size_t place) const {
    return {window_.x0 + static_cast<std::uint32_t>(place % width_),
            window_.y0 + static_cast<std::uint32_t>(place / width_)};
  }
  [[nodiscard]] std::size_t place(const Pixel& pixel) const {
    return static_cast<std::size_t>(pixel.y - window_.y0) * window_.width() + (pixel.x - window_.x0);
  }

 private:
  [[nodiscard]] PixelWindow tile(std::uint64_t index) const {
    const auto x = static_cast<std::uint32_t>(index % std::max(1u, columns_)) * side;
    const auto y = static_cast<std::uint32_t>(index / std::max(1u, columns_)) * side;
    return {window_.x0 + x, window_.y0 + y, window_.x0 + std::min(x + side, window_.width()),
            window_.y0 + std::min(y + side, window_.height())};
  }

  PixelWindow window_;
  std::uint32_t width_;  ///< width of the window, at least 1: a divisor
  std::uint32_t columns_, rows_;
};

}  // namespace tracer
