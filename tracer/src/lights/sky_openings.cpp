#include "tracer/src/lights/sky_openings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

constexpr std::size_t cells_of_side = 64, cells_of_face = cells_of_side * cells_of_side;
constexpr std::size_t faces = 6;  ///< low x, high x, low y, high y, low z, high z

std::array<double, 3> components(const Vec3& v) { return {v.x, v.y, v.z}; }

/// The axes along a face.
std::array<std::size_t, 2> along(std::size_t face) { return {(face / 2 + 1) % 3, (face / 2 + 2) % 3}; }

/// Adds `share` of each cell to those within `reach`, along one axis of a face.
void spread(std::vector<double>& face, std::size_t step, std::size_t reach, double share) {
  const std::vector<double> before = face;
  for (std::size_t cell = 0; cell < cells_of_face; ++cell) {
    const std::size_t at = cell / step % cells_of_side;
    for (std::size_t by = 1; by <= reach; ++by) {
      if (at >= by) face[cell] += before[cell - by * step] * share;
      if (at + by < cells_of_side) face[cell] += before[cell + by * step] * share;
    }
  }
}

/// Makes the noise of few sightings smooth within the openings. A cell beside these is mostly a part of them, too.
void smooth(std::span<double> power) {
  std::vector<double> sum(power.begin(), power.end()), count(cells_of_face);
  for (std::size_t cell = 0; cell < cells_of_face; ++cell) count[cell] = power[cell] > 0 ? 1 : 0;
  std::vector<double> mean = count;
  for (std::vector<double>* const values : {&sum, &count})
    for (const std::size_t step : {std::size_t{1}, cells_of_side}) spread(*values, step, 2, 1);
  for (std::size_t cell = 0; cell < cells_of_face; ++cell) mean[cell] *= mean[cell] > 0 ? sum[cell] / count[cell] : 0;
  for (const std::size_t step : {std::size_t{1}, cells_of_side}) spread(mean, step, 1, 0x1p-4);
  std::ranges::copy(mean, power.begin());
}

}  // namespace

SkyOpenings::SkyOpenings(const Bounds& box, std::span<const SkySighting> sightings) : box_(box) {
  std::vector<double> power(faces * cells_of_face);
  double weight = 0, radiance = 0, sum = 0;
  for (const SkySighting& sighting : sightings) {
    if (!contains(sighting.from)) continue;
    power[exit(sighting.from, sighting.direction).cell] += sighting.radiance * sighting.weight;
    radiance += sighting.radiance * sighting.weight;
    weight += sighting.weight;
  }
  for (std::size_t face = 0; face < faces; ++face)
    smooth(std::span(power).subspan(face * cells_of_face, cells_of_face));
  std::vector<double> row_ends;
  for (std::size_t cell = 0; cell < power.size(); ++cell) {
    const std::size_t face = cell / cells_of_face, row = cell / cells_of_side % cells_of_side,
                      column = cell % cells_of_side;
    if (power[cell] > 0) {
      area_ += cell_area(face);
      lamp_.bounds.include(point_of(face, static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5));
    }
    power[cell] += column == 0 ? 0 : power[cell - 1];
    if (column == cells_of_side - 1) row_ends.push_back(sum += power[cell]);
  }
  if (!(sum > 0 && std::isfinite(sum))) return;
  lamp_.power = radiance / weight * area_;
  row_ends_ = std::move(row_ends);
  column_ends_ = std::move(power);
  guide_.resize(faces * (cells_of_face + cells_of_side));
  const std::span guide(guide_);
  guide_selection(row_ends_, guide.subspan(column_ends_.size()));
  for (std::size_t first = 0; first < column_ends_.size(); first += cells_of_side)
    guide_selection(std::span(column_ends_).subspan(first, cells_of_side), guide.subspan(first, cells_of_side));
}

SkyOpenings::Sample SkyOpenings::sample(const Vec3& from, const Vec2& xi) const {
  if (!contains(from)) return {{0, 0, 1}, 0};
  const std::span guide(guide_);
  const Selected row = select_interval(row_ends_, xi.y, guide.subspan(column_ends_.size()));
  const std::size_t first = row.index * cells_of_side;
  const Selected column =
      select_interval(std::span(column_ends_).subspan(first, cells_of_side), xi.x, guide.subspan(first, cells_of_side));
  const std::size_t face = row.index / cells_of_side;
  const Vec3 offset = point_of(face, static_cast<double>(column.index) + column.position,
                               static_cast<double>(row.index % cells_of_side) + row.position) -
                      from;
  const double distance = length(offset);
  const Vec3 direction = offset / distance;
  const double cosine = std::abs(components(direction)[face / 2]);
  return {direction, row.probability * column.probability * distance * distance / (cosine * cell_area(face))};
}

Vec3 SkyOpenings::point_of(std::size_t face, double column, double row) const {
  const std::array<double, 3> low = components(box_.low), high = components(box_.high);
  std::array<double, 3> at{};
  at[face / 2] = face % 2 == 0 ? low[face / 2] : high[face / 2];
  const auto [u, v] = along(face);
  at[u] = low[u] + (high[u] - low[u]) * column / cells_of_side;
  at[v] = low[v] + (high[v] - low[v]) * row / cells_of_side;
  return {at[0], at[1], at[2]};
}

double SkyOpenings::density(const Vec3& from, const Vec3& direction) const {
  if (!contains(from)) return 0;
  const auto [cell, distance, cosine] = exit(from, direction);
  const double before = cell % cells_of_side == 0 ? 0 : column_ends_[cell - 1];
  return (column_ends_[cell] - before) / row_ends_.back() * distance * distance /
         (cosine * cell_area(cell / cells_of_face));
}

bool SkyOpenings::contains(const Vec3& p) const {
  return p.x > box_.low.x && p.x < box_.high.x && p.y > box_.low.y && p.y < box_.high.y && p.z > box_.low.z &&
         p.z < box_.high.z;
}

SkyOpenings::Exit SkyOpenings::exit(const Vec3& from, const Vec3& direction) const {
  const std::array<double, 3> low = components(box_.low), high = components(box_.high), o = components(from),
                              d = components(direction);
  std::size_t face = 0;
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double to_face = ((d[axis] > 0 ? high[axis] : low[axis]) - o[axis]) / d[axis];
    if (d[axis] == 0 || !(to_face < distance)) continue;
    distance = to_face;
    face = 2 * axis + (d[axis] > 0 ? 1 : 0);
  }
  const auto number = [&](std::size_t axis) {
    const double position = (o[axis] + d[axis] * distance - low[axis]) / (high[axis] - low[axis]);
    return static_cast<std::size_t>(std::clamp(position * cells_of_side, 0.0, cells_of_side - 1.0));
  };
  const auto [u, v] = along(face);
  return {face * cells_of_face + number(v) * cells_of_side + number(u), distance, std::abs(d[face / 2])};
}

double SkyOpenings::cell_area(std::size_t face) const {
  const std::array<double, 3> size = components(box_.high - box_.low);
  const auto [u, v] = along(face);
  return size[u] * size[v] / cells_of_face;
}

}  // namespace tracer
