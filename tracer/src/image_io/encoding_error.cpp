#include "tracer/src/image_io/encoding_error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/display/srgb.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

constexpr std::size_t tile_side = 16;

WHITTLE_WIDE void add_squared_differences(const float* a, const float* b, std::size_t count,
                                          float* __restrict squares) {
  for (std::size_t x = 0; x < count; ++x) {
    const float difference = a[x] - b[x];
    squares[x] += difference * difference;
  }
}

/// Sums of squared differences of one row of tiles.
class TileRow {
 public:
  explicit TileRow(std::size_t width) : squares_(width) {
    for (LevelRow* row : {&image_, &file_})
      for (std::vector<float>& plane : *row) plane.resize(width);
  }

  /// Adds row y of the image to the sums of its tiles.
  void add(const Image& image, std::size_t y, const DisplayTransform& display, const WriteLevelRow& file,
           double* tiles) {
    const std::size_t width = squares_.size();
    display.show(std::span(image.rgb).subspan(3 * y * width, 3 * width), image_);
    file(y, file_);
    std::fill(squares_.begin(), squares_.end(), 0.0f);
    for (std::size_t channel = 0; channel < 3; ++channel)
      add_squared_differences(image_[channel].data(), file_[channel].data(), width, squares_.data());
    for (std::size_t x = 0; x < width; ++x) tiles[x / tile_side] += squares_[x];
  }

 private:
  LevelRow image_, file_;
  std::vector<float> squares_;
};

/// Linear value of each code.
template <class Code>
const std::vector<float>& linear_table() {
  static const std::vector<float> table = [] {
    constexpr std::size_t most = std::numeric_limits<Code>::max();
    std::vector<float> linear(most + 1);
    for (std::size_t code = 0; code <= most; ++code)
      linear[code] = static_cast<float>(linear_from_srgb(static_cast<double>(code) / most));
    return linear;
  }();
  return table;
}

/// All channels at once.
template <class Code>
WHITTLE_INLINE void to_levels(const Code* codes, std::size_t count, float* __restrict r, float* __restrict g,
                              float* __restrict b) {
  constexpr float level = 255.0f / std::numeric_limits<Code>::max();
  for (std::size_t x = 0; x < count; ++x) {
    r[x] = static_cast<float>(codes[3 * x]) * level;
    g[x] = static_cast<float>(codes[3 * x + 1]) * level;
    b[x] = static_cast<float>(codes[3 * x + 2]) * level;
  }
}
WHITTLE_WIDE void write_opaque(std::span<const std::uint8_t> row, LevelRow& levels) {
  to_levels(row.data(), row.size() / 3, levels[0].data(), levels[1].data(), levels[2].data());
}
WHITTLE_WIDE void write_opaque(std::span<const std::uint16_t> row, LevelRow& levels) {
  to_levels(row.data(), row.size() / 3, levels[0].data(), levels[1].data(), levels[2].data());
}

template <class Code>
void write_over_black(std::span<const Code> row, LevelRow& levels) {
  constexpr float most = std::numeric_limits<Code>::max();
  const std::vector<float>& linear = linear_table<Code>();
  std::vector<float> over_black;
  over_black.reserve(row.size() / 4 * 3);
  for (std::size_t i = 0; i < row.size(); i += 4)
    for (std::size_t channel = 0; channel < 3; ++channel)
      over_black.push_back(linear[row[i + channel]] * (static_cast<float>(row[i + 3]) / most));
  DisplayTransform({}, 0).show(over_black, levels);
}

template <class Code>
WriteLevelRow write_levels(std::span<const Code> codes, int channels, std::uint32_t width) {
  const std::size_t row_size = static_cast<std::size_t>(channels) * width;
  return [=](std::size_t y, LevelRow& levels) {
    const std::span<const Code> row = codes.subspan(y * row_size, row_size);
    channels == 4 ? write_over_black(row, levels) : write_opaque(row, levels);
  };
}

}  // namespace

WriteLevelRow levels_of(std::span<const std::uint8_t> codes, int channels, std::uint32_t width) {
  return write_levels(codes, channels, width);
}

WriteLevelRow levels_of(std::span<const std::uint16_t> codes, int channels, std::uint32_t width) {
  return write_levels(codes, channels, width);
}

EncodingError encoding_error(const Image& image, const DisplayTransform& display, const WriteLevelRow& file) {
  const std::size_t width = image.width, height = image.height;
  const std::size_t columns = (width + tile_side - 1) / tile_side, rows = (height + tile_side - 1) / tile_side;
  std::vector<double> tiles(columns * rows);
  for_each_tile(rows, 0, [&](std::uint64_t row) {
    TileRow sums(width);
    const std::size_t first = row * tile_side, last = std::min(first + tile_side, height);
    for (std::size_t y = first; y < last; ++y) sums.add(image, y, display, file, &tiles[row * columns]);
  });
  double sum = 0, worst = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const std::size_t tile_pixels =
          std::min(tile_side, width - column * tile_side) * std::min(tile_side, height - row * tile_side);
      const double squared = tiles[row * columns + column];
      sum += squared;
      worst = std::max(worst, squared / static_cast<double>(3 * tile_pixels));
    }
  }
  return {std::sqrt(sum / static_cast<double>(3 * width * height)), std::sqrt(worst)};
}

FileError file_error(const ErrorEstimate& image, const EncodingError& encoding) {
  const double squared = image.estimate * image.estimate, difference = encoding.image;
  const double fixed = std::sqrt(std::max(0.0, squared - image.sampling * image.sampling));
  FileError error;
  error.estimate = std::sqrt(squared + difference * (difference + 2 * fixed));
  error.proven = image.proven + difference;
  error.worst_tile = image.worst_tile + encoding.worst_tile;
  error.encoding = difference;
  error.target_met = (!image.target || error.estimate <= *image.target) &&
                     (!image.tile_target || error.worst_tile <= *image.tile_target);
  return error;
}

}  // namespace tracer
