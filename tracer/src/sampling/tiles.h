#pragma once
/// Parts of the image that are processed in parallel: tiles, each traced by one thread and read by previews in between,
/// and blocks of rows.

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <numeric>
#include <vector>

#include "tracer/control.h"
#include "tracer/scene.h"
#include "tracer/src/math/vec.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {

struct Pixel {
  std::uint32_t x, y;
};

/// A permutation of [0, count) that scatters neighbors: multiples of about the golden ratio, coprime to `count`.
inline std::uint64_t scattered(std::uint64_t index, std::uint64_t count) {
  auto step = static_cast<std::uint64_t>(static_cast<double>(count) * 0.6180339887498949) | 1;
  while (std::gcd(step, count) != 1) step += 2;
  return (index * step) % count;
}

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
    const auto [x0, y0, x1, y1] = window(index);
    std::vector<Pixel> pixels(static_cast<std::size_t>(x1 - x0) * (y1 - y0));
    Pixel* next = pixels.data();
    for (std::uint32_t by = y0; by < y1; by += 4)
      for (std::uint32_t bx = x0; bx < x1; bx += 4)
        for (std::uint32_t y = by, bottom = std::min(by + 4, y1); y < bottom; ++y)
          for (std::uint32_t x = bx, right = std::min(bx + 4, x1); x < right; ++x) *next++ = {x, y};
    return pixels;
  }

  static constexpr std::uint32_t side = 32;
  /// Pixels of the tile in the full image.
  [[nodiscard]] PixelWindow window(std::uint64_t index) const {
    const auto x = static_cast<std::uint32_t>(index % std::max(1u, columns_)) * side;
    const auto y = static_cast<std::uint32_t>(index / std::max(1u, columns_)) * side;
    return {window_.x0 + x, window_.y0 + y, window_.x0 + std::min(x + side, window_.width()),
            window_.y0 + std::min(y + side, window_.height())};
  }

  /// The same in the window of the tiles.
  [[nodiscard]] PixelWindow places(std::uint64_t index) const {
    const PixelWindow pixels = window(index);
    return {pixels.x0 - window_.x0, pixels.y0 - window_.y0, pixels.x1 - window_.x0, pixels.y1 - window_.y0};
  }
  /// Tile number `index` in an order that scatters neighbors.
  [[nodiscard]] std::uint64_t scattered(std::uint64_t index) const { return tracer::scattered(index, count()); }
  /// Place of the tile's first pixel.
  [[nodiscard]] std::size_t first_place(std::uint64_t index) const {
    const PixelWindow pixels = window(index);
    return place({pixels.x0, pixels.y0});
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
  PixelWindow window_;
  std::uint32_t width_;  ///< width of the window, at least 1: a divisor
  std::uint32_t columns_, rows_;
};

/// Sum over the parts of a loop, in their order: work(i, sum) adds part i to an empty sum.
template <class Sum, class Work>
Sum sum_in_parallel(const InParallel& in_parallel, std::uint64_t count, const Work& work) {
  std::vector<Sum> parts(count);
  in_parallel(count, [&](std::uint64_t i) {
    Sum part;
    work(i, part);
    parts[i] = part;
  });
  Sum sum;
  for (const Sum& part : parts) sum.add(part);
  return sum;
}

/// Blocks of image rows. They do not depend on the number of threads, and neither do sums over blocks in their order.
class Blocks {
 public:
  /// `pixels` is a multiple of `width`.
  Blocks(std::size_t pixels, std::uint32_t width)
      : width_(std::max(1u, width)),
        rows_(pixels / width_),
        rows_each_(std::max({std::size_t{1}, block_pixels_min / width_, rows_ / blocks_max})) {}

  [[nodiscard]] std::uint64_t count() const { return (rows_ + rows_each_ - 1) / rows_each_; }

  /// First row of the block; for count(), one past the last row.
  [[nodiscard]] std::size_t first_row(std::uint64_t block) const { return std::min(rows_, block * rows_each_); }

  /// Calls work(place, x, y) for each pixel of the block, in order.
  template <class Work>
  void each_pixel(std::uint64_t block, const Work& work) const {
    std::size_t place = first_row(block) * width_;
    for (std::size_t y = first_row(block); y < first_row(block + 1); ++y)
      for (std::size_t x = 0; x < width_; ++x) work(place++, x, y);
  }

 private:
  static constexpr std::size_t block_pixels_min = 8192;  ///< worth a task
  static constexpr std::size_t blocks_max = 64;          ///< about; the first row of a block reads the rows above it
  std::size_t width_, rows_, rows_each_;
};

/// Tiles of a running render for a Preview. Without a preview all functions do nothing. A preview reads tiles only
/// while an Open lives.
class PreviewTiles {
 public:
  /// The color of the pixel at a place of the window, read under the lock of its tile.
  using Mean = std::function<Color(std::size_t place)>;
  /// `preview` may be null. It and `tiles` must outlive this.
  PreviewTiles(Preview* preview, const Tiles& tiles, const PixelWindow& window, Mean mean);
  ~PreviewTiles();
  PreviewTiles(PreviewTiles&&) = delete;

  /// Publishes the tiles: while it lives, they are written under their locks only. To be created and destroyed on the
  /// thread of the constructor.
  class Open {
   public:
    explicit Open(PreviewTiles& tiles) : tiles_(tiles) {
      if (tiles_.preview_ != nullptr) tiles_.closed_.unlock();
    }
    ~Open() {
      if (tiles_.preview_ != nullptr) tiles_.closed_.lock();
    }
    Open(Open&&) = delete;

   private:
    PreviewTiles& tiles_;
  };

  /// Lock of a tile, held for microseconds. After the first unlock() the tile is visible.
  class Tile {
   public:
    Tile(PreviewTiles& tiles, std::uint64_t index) : tiles_(tiles), index_(index) {}
    void lock() { tiles_.lock(index_); }
    void unlock() { tiles_.unlock(index_); }

   private:
    PreviewTiles& tiles_;
    std::uint64_t index_;
  };

 private:
  friend class Preview;
  enum State : std::uint8_t { empty, visible, locked };

  void lock(std::uint64_t tile) const;
  void unlock(std::uint64_t tile) const;
  [[nodiscard]] Image read(std::uint32_t side) const;

  Preview* preview_;
  const Tiles& tiles_;
  std::uint32_t width_, height_;
  Mean mean_;
  std::unique_ptr<std::atomic<std::uint8_t>[]> states_;  ///< by tile; null without a preview
  std::unique_lock<std::mutex> closed_;
};

}  // namespace tracer
