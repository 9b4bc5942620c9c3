#pragma once
/// An image's rows in blocks that are worked on at the same time. Blocks are the same whatever the number of threads,
/// and so are sums that are taken of each and added up in their order.

#include <algorithm>
#include <cstdint>
#include <functional>

namespace tracer {

/// Calls a function with every number below `count`, on as many threads as it likes; returns when all is done.
using InParallel = std::function<void(std::uint64_t count, const std::function<void(std::uint64_t)>& work)>;

class Blocks {
 public:
  /// `pixels` is a multiple of `width`.
  Blocks(std::size_t pixels, std::uint32_t width)
      : width_(std::max(1u, width)),
        rows_(pixels / width_),
        rows_each_(std::max({std::size_t{1}, enough / width_, rows_ / many})) {}

  [[nodiscard]] std::uint64_t count() const { return (rows_ + rows_each_ - 1) / rows_each_; }

  /// Of the block, or one past the last row where there is no such block.
  [[nodiscard]] std::size_t first_row(std::uint64_t block) const { return std::min(rows_, block * rows_each_); }

  /// Calls work(place, x, y) for each pixel of the block, in order.
  template <class Work>
  void each_pixel(std::uint64_t block, const Work& work) const {
    std::size_t place = first_row(block) * width_;
    for (std::size_t y = first_row(block); y < first_row(block + 1); ++y)
      for (std::size_t x = 0; x < width_; ++x) work(place++, x, y);
  }

 private:
  static constexpr std::size_t enough = 8192;  ///< pixels, to be worth a task
  static constexpr std::size_t many = 64;      ///< blocks, beyond which they grow: their first rows look at those above
  std::size_t width_, rows_, rows_each_;
};

}  // namespace tracer
