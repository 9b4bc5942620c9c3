#pragma once
/// Blocks of image rows that are processed in parallel. Blocks do not depend on the number of threads, and neither do
/// sums over blocks in their order.

#include <algorithm>
#include <cstdint>
#include <functional>

namespace tracer {

/// Calls a function with every number below `count`, in parallel; returns when all calls have returned.
using InParallel = std::function<void(std::uint64_t count, const std::function<void(std::uint64_t)>& work)>;

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

}  // namespace tracer
