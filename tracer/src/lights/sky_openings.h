#pragma once
/// Sampling of a sky that surfaces see through openings, such as the windows of a room. The openings are cells on the
/// faces of a box around these surfaces, at which rays to the sky leave it, and are sampled as lamps of their size:
/// uniformly over the area of a cell, and a cell by the light that came through it. Where an opening lies within the
/// box its cells are behind it.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/lights/light_tree.h"
#include "tracer/src/math/affine.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// A ray from a surface that met the sky, and its share of the light that comes from there.
struct SkySighting {
  Vec3 from, direction;
  double radiance = 0, weight = 0;  ///< their product is its power
};

class SkyOpenings {
 public:
  SkyOpenings() = default;
  /// `box`: around the surfaces. Empty without sightings, or if their power is not finite. Throws std::bad_alloc.
  SkyOpenings(const Bounds& box, std::span<const SkySighting> sightings);

  [[nodiscard]] bool empty() const { return row_ends_.empty(); }
  /// False where sample() finds nothing.
  [[nodiscard]] bool contains(const Vec3& p) const;
  /// A lamp around the centers of all cells, with the mean radiance of the sky in them.
  [[nodiscard]] const LightTree::Lamp& lamp() const { return lamp_; }
  [[nodiscard]] double area() const { return area_; }

  struct Sample {
    Vec3 direction;      ///< unit
    double density = 0;  ///< as density()
  };
  /// A direction from a point for `xi` uniform in [0,1)^2; of density 0 if the point is outside of the box.
  /// Precondition: it is not empty.
  [[nodiscard]] Sample sample(const Vec3& from, const Vec2& xi) const;
  /// Density, per solid angle, of a unit direction; 0 if sample() never selects it.
  [[nodiscard]] double density(const Vec3& from, const Vec3& direction) const;

  [[nodiscard]] std::uint64_t memory_bytes() const {
    return (row_ends_.capacity() + column_ends_.capacity()) * sizeof(double) + guide_.capacity() * sizeof(guide_[0]);
  }

 private:
  /// A point on the faces.
  struct Exit {
    std::size_t cell = 0;
    double distance = 0, cosine = 0;  ///< to the point, and at the face
  };
  [[nodiscard]] Exit exit(const Vec3& from, const Vec3& direction) const;
  [[nodiscard]] double cell_area(std::size_t face) const;
  /// A point of a face, in cells along its axes.
  [[nodiscard]] Vec3 point_of(std::size_t face, double column, double row) const;

  Bounds box_;
  LightTree::Lamp lamp_;
  double area_ = 0;                   ///< total, in squared units of render space
  std::vector<double> row_ends_;      ///< sums of the powers of rows of cells, face by face
  std::vector<double> column_ends_;   ///< sums of the powers of the cells of each row
  std::vector<std::uint16_t> guide_;  ///< for the cells of each row, then for the rows
};

}  // namespace tracer
