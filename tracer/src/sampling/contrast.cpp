#include "tracer/src/sampling/contrast.h"

#include <algorithm>
#include <limits>

namespace tracer {
namespace {

constexpr std::size_t no_row = std::numeric_limits<std::size_t>::max();

WHITTLE_INLINE float squared_second_difference(float before, float at, float after) {
  const float difference = before - 2 * at + after;
  return difference * difference;
}

/// Raises the contrasts of the pixels x in [first, last) of row `at` to the contrast in one direction: `step` to the
/// left in row `before` and `step` to the right in row `after`.
WHITTLE_WIDE void raise_contrast(const CodeValueRow& before, const CodeValueRow& at, const CodeValueRow& after,
                                 std::ptrdiff_t step, std::ptrdiff_t first, std::ptrdiff_t last, float* contrast) {
  const float *const r0 = before[0].data(), *const g0 = before[1].data(), *const b0 = before[2].data();
  const float *const r1 = at[0].data(), *const g1 = at[1].data(), *const b1 = at[2].data();
  const float *const r2 = after[0].data(), *const g2 = after[1].data(), *const b2 = after[2].data();
  for (std::ptrdiff_t x = first; x < last; ++x) {
    const float sum = squared_second_difference(r0[x - step], r1[x], r2[x + step]) +
                      squared_second_difference(g0[x - step], g1[x], g2[x + step]) +
                      squared_second_difference(b0[x - step], b1[x], b2[x + step]);
    contrast[x] = contrast[x] < sum ? sum : contrast[x];
  }
}

}  // namespace

ContrastRows::ContrastRows(std::size_t columns, std::size_t rows,
                           std::function<void(std::size_t, CodeValueRow&)> write_row)
    : columns_(columns), rows_(rows), write_row_(std::move(write_row)), contrast_(columns) {
  kept_row_.fill(no_row);
  for (CodeValueRow& row : kept_)
    for (std::vector<float>& plane : row) plane.resize(columns);
}

const CodeValueRow& ContrastRows::code_values(std::size_t y) {
  CodeValueRow& row = kept_[y % 3];
  if (kept_row_[y % 3] != y) write_row_(y, row);
  kept_row_[y % 3] = y;
  return row;
}

std::span<const float> ContrastRows::row(std::size_t y) {
  float* const contrast = contrast_.data();
  std::fill(contrast_.begin(), contrast_.end(), 0.0f);
  const auto columns = static_cast<std::ptrdiff_t>(columns_);
  const bool wide = columns >= 3, high = rows_ >= 3;
  const std::size_t middle = high ? std::clamp<std::size_t>(y, 1, rows_ - 2) : y;
  if (wide) {
    const CodeValueRow& own = code_values(y);
    raise_contrast(own, own, own, 1, 1, columns - 1, contrast);
    if (high) {
      raise_contrast(code_values(middle - 1), code_values(middle), code_values(middle + 1), 1, 1, columns - 1,
                     contrast);
      raise_contrast(code_values(middle - 1), code_values(middle), code_values(middle + 1), -1, 1, columns - 1,
                     contrast);
    }
    contrast_.front() = contrast_[1];
    contrast_.back() = contrast_[columns_ - 2];
  }
  if (high)
    raise_contrast(code_values(middle - 1), code_values(middle), code_values(middle + 1), 0, 0, columns, contrast);
  return contrast_;
}

}  // namespace tracer
