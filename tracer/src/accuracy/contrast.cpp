#include "tracer/src/accuracy/contrast.h"

#include <algorithm>

namespace tracer {
namespace {

double squared_second_difference(const float* before, const float* at, const float* after) {
  double sum = 0;
  for (int channel = 0; channel < 3; ++channel) {
    const double bend = before[channel] - 2.0 * at[channel] + after[channel];
    sum += bend * bend;
  }
  return sum;
}

}  // namespace

std::vector<float> contrasts(std::span<const float> shown, std::uint32_t width) {
  const auto columns = static_cast<std::int64_t>(width);
  const auto rows = static_cast<std::int64_t>(shown.size() / 3) / columns;
  const auto at = [&](std::int64_t x, std::int64_t y) { return shown.data() + 3 * (y * columns + x); };
  constexpr std::int64_t directions[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
  std::vector<float> result(shown.size() / 3);
  for (std::int64_t y = 0; y < rows; ++y) {
    for (std::int64_t x = 0; x < columns; ++x) {
      double contrast = 0;
      for (const auto& [dx, dy] : directions) {
        if ((dx != 0 && columns < 3) || (dy != 0 && rows < 3)) continue;
        // At the picture's border: of the nearest three in a row that it has.
        const std::int64_t cx = dx != 0 ? std::clamp<std::int64_t>(x, 1, columns - 2) : x;
        const std::int64_t cy = dy != 0 ? std::clamp<std::int64_t>(y, 1, rows - 2) : y;
        contrast =
            std::max(contrast, squared_second_difference(at(cx - dx, cy - dy), at(cx, cy), at(cx + dx, cy + dy)));
      }
      result[static_cast<std::size_t>(y * columns + x)] = static_cast<float>(contrast);
    }
  }
  return result;
}

double expected_variance(double contrast) {
  constexpr double edge = 3 * 6 * 6;  // six levels in each channel: below, shading bends as much
  return contrast >= edge ? contrast / 12 : contrast / 144;
}

}  // namespace tracer
