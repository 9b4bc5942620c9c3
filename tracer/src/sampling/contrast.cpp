#include "tracer/src/sampling/contrast.h"

#include <algorithm>
#include <limits>

#include "tracer/src/math/wide.h"

namespace tracer {
namespace {

constexpr std::size_t no_row = std::numeric_limits<std::size_t>::max();

WHITTLE_INLINE float squared_bend(float before, float at, float after) {
  const float bend = before - 2 * at + after;
  return bend * bend;
}

/// Raises the contrasts of the pixels x in [first, last) of the row `at` to that in one direction: `step` to the left
/// in the row `before`, as much to the right in the row `after`.
WHITTLE_WIDE void raise(const ShownRow& before, const ShownRow& at, const ShownRow& after, std::ptrdiff_t step,
                        std::ptrdiff_t first, std::ptrdiff_t last, float* contrast) {
  const float *const r0 = before[0].data(), *const g0 = before[1].data(), *const b0 = before[2].data();
  const float *const r1 = at[0].data(), *const g1 = at[1].data(), *const b1 = at[2].data();
  const float *const r2 = after[0].data(), *const g2 = after[1].data(), *const b2 = after[2].data();
  for (std::ptrdiff_t x = first; x < last; ++x) {
    const float bent = squared_bend(r0[x - step], r1[x], r2[x + step]) +
                       squared_bend(g0[x - step], g1[x], g2[x + step]) +
                       squared_bend(b0[x - step], b1[x], b2[x + step]);
    contrast[x] = contrast[x] < bent ? bent : contrast[x];
  }
}

}  // namespace

ContrastRows::ContrastRows(std::size_t columns, std::size_t rows, std::function<void(std::size_t, ShownRow&)> show)
    : columns_(columns), rows_(rows), show_(std::move(show)), contrast_(columns) {
  kept_row_.fill(no_row);
  for (ShownRow& row : kept_)
    for (std::vector<float>& plane : row) plane.resize(columns);
}

const ShownRow& ContrastRows::to_display(std::size_t y) {
  ShownRow& row = kept_[y % 3];
  if (kept_row_[y % 3] != y) show_(y, row);
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
    const ShownRow& own = to_display(y);
    raise(own, own, own, 1, 1, columns - 1, contrast);
    if (high) {
      raise(to_display(middle - 1), to_display(middle), to_display(middle + 1), 1, 1, columns - 1, contrast);
      raise(to_display(middle - 1), to_display(middle), to_display(middle + 1), -1, 1, columns - 1, contrast);
    }
    contrast_.front() = contrast_[1];
    contrast_.back() = contrast_[columns_ - 2];
  }
  if (high) raise(to_display(middle - 1), to_display(middle), to_display(middle + 1), 0, 0, columns, contrast);
  return contrast_;
}

}  // namespace tracer
