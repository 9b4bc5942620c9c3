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

float Contrasts::at(std::size_t column, std::size_t row) const {
  constexpr std::int64_t directions[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
  const auto x = static_cast<std::int64_t>(column), y = static_cast<std::int64_t>(row);
  const auto shown_at = [&](std::int64_t ax, std::int64_t ay) { return shown_.data() + 3 * (ay * columns_ + ax); };
  double contrast = 0;
  for (const auto& [dx, dy] : directions) {
    if ((dx != 0 && columns_ < 3) || (dy != 0 && rows_ < 3)) continue;
    // At the picture's border: of the nearest three in a row that it has.
    const std::int64_t cx = dx != 0 ? std::clamp<std::int64_t>(x, 1, columns_ - 2) : x;
    const std::int64_t cy = dy != 0 ? std::clamp<std::int64_t>(y, 1, rows_ - 2) : y;
    contrast = std::max(
        contrast, squared_second_difference(shown_at(cx - dx, cy - dy), shown_at(cx, cy), shown_at(cx + dx, cy + dy)));
  }
  return static_cast<float>(contrast);
}

std::vector<float> contrasts(std::span<const float> shown, std::uint32_t width) {
  const Contrasts contrast(shown, width);
  std::vector<float> result;
  result.reserve(shown.size() / 3);
  for (std::size_t i = 0; i < shown.size() / 3; ++i) result.push_back(contrast.at(i % width, i / width));
  return result;
}

double expected_variance(double contrast) {
  constexpr double edge = 3 * 6 * 6;  // six levels in each channel: below, shading bends as much
  return contrast >= edge ? contrast / 12 : contrast / 144;
}

}  // namespace tracer
