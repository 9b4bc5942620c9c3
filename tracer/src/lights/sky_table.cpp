#include "tracer/src/lights/sky_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "tracer/src/math/sampling.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

constexpr double columns_max = 2048, rows_max = 1024;  ///< 16 MB; a cell of a larger image has several of its texels

/// Cells along one axis, and the number of texels along each.
struct Division {
  std::size_t cells, texels;
  Division(double texels_of_all, double cells_max)
      : cells(static_cast<std::size_t>(std::clamp(std::nearbyint(texels_of_all), 2.0, cells_max))),
        texels(static_cast<std::size_t>(
            std::clamp(std::ceil(texels_of_all / static_cast<double>(cells)), 1.0, cells_max))) {}
};

/// Mean over a cell of an image that is interpolated between the centers of the cells, along one axis.
double interpolated_mean(double before, double at, double after) { return (before + 6 * at + after) / 8; }

}  // namespace

SkyTable::SkyTable(const CompiledBackground& background) : grid_(background.grid()) {
  if (!(grid_.columns > 0)) return;
  const Division across(grid_.columns, columns_max), along(grid_.rows, rows_max);
  const std::size_t columns = across.cells, rows = along.cells;
  std::vector<double> radiance(columns * rows), smooth(columns * rows);
  const double share = 1 / static_cast<double>(across.texels * along.texels);
  for_each_tile(rows, 0, [&](std::uint64_t row) {
    for (std::size_t i = 0; i < columns * across.texels * along.texels; ++i) {
      const std::size_t x = i % (columns * across.texels), y = row * along.texels + i / (columns * across.texels);
      const Vec2 uv{(static_cast<double>(x) + 0.5) / static_cast<double>(columns * across.texels),
                    (static_cast<double>(y) + 0.5) / static_cast<double>(rows * along.texels)};
      radiance[row * columns + x / across.texels] += share * max_component(background.radiance_at(uv));
    }
  });
  for_each_tile(rows, 0, [&](std::uint64_t row) {
    const double* at = &radiance[row * columns];
    const double *below = row > 0 ? at - columns : at, *above = row + 1 < rows ? at + columns : at;
    const auto of_column = [&](std::size_t x) { return interpolated_mean(below[x], at[x], above[x]); };
    for (std::size_t x = 0; x < columns; ++x)
      smooth[row * columns + x] =
          interpolated_mean(of_column((x + columns - 1) % columns), of_column(x), of_column((x + 1) % columns));
  });
  columns_ = columns;
  for (std::size_t row = 0; row <= rows; ++row)
    sines_.push_back(std::sin(std::numbers::pi * (static_cast<double>(row) / static_cast<double>(rows) - 0.5)));
  double sum = 0;
  for (std::size_t row = 0; row < rows; ++row) {
    double of_row = 0;
    for (std::size_t x = 0; x < columns; ++x) column_ends_.push_back(of_row += smooth[row * columns + x]);
    row_ends_.push_back(sum += of_row * cell_angle(row));
  }
  if (!(sum > 0 && std::isfinite(sum))) *this = {};
}

/// Solid angle of each cell of a row.
double SkyTable::cell_angle(std::size_t row) const {
  return (sines_[row + 1] - sines_[row]) * 2 * std::numbers::pi / static_cast<double>(columns_);
}

SkyTable::Sample SkyTable::sample(const Vec2& xi) const {
  const Selected row = select_interval(row_ends_, xi.y);
  const Selected column = select_interval(std::span(column_ends_).subspan(row.index * columns_, columns_), xi.x);
  const double sine = sines_[row.index] + (sines_[row.index + 1] - sines_[row.index]) * row.position;
  const Vec2 level =
      point_of_circle((static_cast<double>(column.index) + column.position) / static_cast<double>(columns_));
  const double across = std::sqrt(std::max(0.0, 1 - sine * sine));
  return {grid_.up * sine - (grid_.ahead * level.x + grid_.right * level.y) * across,
          row.probability * column.probability / cell_angle(row.index)};
}

double SkyTable::density(const Vec3& direction) const {
  const double sine = dot(direction, grid_.up);
  const double turn =
      0.5 + std::atan2(dot(direction, grid_.right), dot(direction, grid_.ahead)) / (2 * std::numbers::pi);
  const auto above = std::upper_bound(sines_.begin() + 1, sines_.end() - 1, sine);
  const auto row = static_cast<std::size_t>(above - sines_.begin()) - 1;
  const auto column = std::min(static_cast<std::size_t>(turn * static_cast<double>(columns_)), columns_ - 1);
  const double* ends = &column_ends_[row * columns_];
  const double of_row = (row_ends_[row] - (row > 0 ? row_ends_[row - 1] : 0)) / row_ends_.back();
  const double of_cell = ends[column] - (column > 0 ? ends[column - 1] : 0);
  return of_cell > 0 ? of_row * (of_cell / ends[columns_ - 1]) / cell_angle(row) : 0;
}

}  // namespace tracer
