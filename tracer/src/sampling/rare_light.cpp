#include "tracer/src/sampling/rare_light.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tracer {
namespace {

/// Pixels [first, last) of the rows of a block.
struct Cell {
  std::size_t first, last, first_row, last_row;
  [[nodiscard]] double pixels() const { return static_cast<double>((last - first) * (last_row - first_row)); }
};

/// Spread of the pixels of a cell that is due to chance.
struct ChanceSpread {
  double squared = 0;  ///< sum of squared distances from the cell's mean, in squared code values
  double hits = 1;     ///< number of bright pixels that would have the same mean and spread
};

/// The spread of one channel. The cell's mean stands for the true value of its pixels. Of their variance around it,
/// chance causes what the pixels' deviations explain or, of a single sample, the differences between neighbors; the
/// rest is what the image shows.
ChanceSpread chance_spread(const UniformPixels& pixels, const DisplayTransform& display, const Cell& cell,
                           std::size_t channel, double chance_min) {
  double sum = 0, squares = 0, by_chance = 0;
  const auto each_value = [&](const auto& use) {
    for (std::size_t y = cell.first_row; y < cell.last_row; ++y)
      for (std::size_t x = cell.first; x < cell.last; ++x) use(3 * (y * pixels.width + x) + channel, x);
  };
  each_value([&](std::size_t i, std::size_t x) {
    const double value = pixels.rgb[i];
    sum += value;
    squares += value * value;
    if (!pixels.deviation.empty()) {
      by_chance += double{pixels.deviation[i]} * pixels.deviation[i];
    } else if (x > cell.first) {
      by_chance += std::pow(value - pixels.rgb[i - 3], 2) / 2;
    }
  });
  const double count = cell.pixels(), mean = sum / count, spread = squares - sum * mean;
  if (!(spread > 0) || by_chance < chance_min * spread) return {};
  const double level = display.level(mean);
  ChanceSpread result{0, sum * sum / squares};
  each_value([&](std::size_t i, std::size_t) { result.squared += std::pow(display.level(pixels.rgb[i]) - level, 2); });
  result.squared *= std::min(1.0, by_chance / spread);
  return result;
}

}  // namespace

SummedErrors add_rare_light(const UniformPixels& pixels, const DisplayTransform& display, std::size_t first_row,
                            std::span<float> variances, double chance_min) {
  constexpr std::size_t cell_pixels = 1024;  // few enough to be alike, enough to have hits of one in a hundred
  const std::size_t rows = variances.size() / pixels.width;
  const std::size_t cells = std::max<std::size_t>(1, variances.size() / cell_pixels);
  SummedErrors added;
  for (std::size_t i = 0; i < cells; ++i) {
    const Cell cell{i * pixels.width / cells, (i + 1) * pixels.width / cells, first_row, first_row + rows};
    if (cell.first == cell.last) continue;
    const auto each_row = [&](const auto& use) {
      for (std::size_t row = 0; row < rows; ++row)
        use(variances.subspan(row * pixels.width + cell.first, cell.last - cell.first));
    };
    double missing = 0, variance = 0;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const ChanceSpread spread = chance_spread(pixels, display, cell, channel, chance_min);
      missing += spread.squared;
      variance += spread.squared * spread.squared / spread.hits;
    }
    each_row([&](std::span<float> row) { missing -= std::accumulate(row.begin(), row.end(), 0.0); });
    if (!(missing > 0)) continue;
    // The channels of a hit are alike: their deviations add up, to at most the square root of three times the sum.
    added.add(SummedErrors{0, 3 * variance, 0});
    const auto each = static_cast<float>(missing / cell.pixels());
    each_row([&](std::span<float> row) {
      for (float& one : row) one += each;
    });
  }
  return added;
}

}  // namespace tracer
