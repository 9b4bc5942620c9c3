#pragma once
/// Directions toward a background with textures, in proportion to its radiance: cells of equal longitude and latitude
/// are selected by their power (Pharr, Jakob, Humphreys 2023, "Physically Based Rendering", 4th ed., sec. 12.5).

#include <cstdint>
#include <vector>

#include "tracer/src/textures/background.h"

namespace tracer {

class SkyTable {
 public:
  SkyTable() = default;
  /// Evaluates the background at each of its texels, on the threads of the calling arena. Empty if it has no textures,
  /// or is black or infinitely bright. Throws std::bad_alloc.
  explicit SkyTable(const CompiledBackground& background);

  [[nodiscard]] bool empty() const { return row_ends_.empty(); }
  /// Radiance integrated over all directions. Precondition: it is not empty.
  [[nodiscard]] double irradiance() const { return row_ends_.back(); }

  struct Sample {
    Vec3 direction;  ///< unit
    double density = 0;
  };
  /// A direction for `xi` uniform in [0,1)^2. Precondition: it is not empty.
  [[nodiscard]] Sample sample(const Vec2& xi) const;
  /// Density, per solid angle, of a unit direction. 0 only where sample() never selects it.
  [[nodiscard]] double density(const Vec3& direction) const;

  [[nodiscard]] std::uint64_t memory_bytes() const {
    return (sines_.capacity() + row_ends_.capacity() + column_ends_.capacity()) * sizeof(double);
  }

 private:
  [[nodiscard]] double cell_angle(std::size_t row) const;

  CompiledBackground::DirectionGrid grid_;  ///< its columns and rows are those of the table
  std::size_t columns_ = 0;
  std::vector<double> sines_;        ///< for the latitudes at which rows begin and the last ends
  std::vector<double> row_ends_;     ///< sums of the powers of rows
  std::vector<double> column_ends_;  ///< sums of the powers of the cells of each row
};

}  // namespace tracer
