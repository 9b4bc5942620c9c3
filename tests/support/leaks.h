#pragma once
/// Counts the rays that get through closed meshes where their triangles meet.

#include <cstdint>

#include "tracer/src/accel/geometry.h"

namespace leaks {

/// Where rays are aimed: exactly at vertices, or at points of edges as exactly as doubles can.
enum class CameraRay { vertices, edges };

struct Count {
  std::uint64_t rays = 0;
  std::uint64_t leaked = 0;  ///< met nothing up to the place they were aimed at
  Count& operator+=(const Count& other) {
    rays += other.rays;
    leaked += other.leaked;
    return *this;
  }
};

/// Rays from anywhere, near and far, inside and outside, at a vertex or edge whose triangles all turn the same side to
/// the ray: it can't pass there. Precondition: `mesh` is closed and in a frame of about one unit, as compiled scenes'
/// are.
Count count(const tracer::TriangleGeometry& mesh, CameraRay generate_ray, std::uint64_t rays, std::uint64_t seed);

/// A profile of `rings` radii along z, round an axis in `around` steps, closed at both ends by a fan: of many steps and
/// few rings or the other way round it is made of needles. Fronts outside; fits the unit cube around 0.
tracer::Mesh lathe(std::uint32_t around, std::uint32_t rings);
/// Twelve triangles, 1 x 0.7 x 0.4. Fronts outside.
tracer::Mesh box();

}  // namespace leaks
