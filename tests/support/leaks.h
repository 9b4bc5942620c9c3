#pragma once
/// Counts rays that leak through the edges and vertices of closed meshes.

#include <cstdint>

#include "tracer/src/accel/accelerator.h"

namespace leaks {

/// Targets of rays: exactly the vertices, or points of edges rounded to double.
enum class CameraRay { vertices, edges };

struct Count {
  std::uint64_t rays = 0;
  std::uint64_t leaked = 0;  ///< rays without a hit up to the target
  Count& operator+=(const Count& other) {
    rays += other.rays;
    leaked += other.leaked;
    return *this;
  }
};

/// Rays from random origins, near and far, inside and outside, at a vertex or edge whose triangles all have the same
/// orientation towards the ray: it must not pass. Precondition: `mesh` is closed, of about unit size like compiled
/// scenes.
Count count(const tracer::TriangleGeometry& mesh, CameraRay generate_ray, std::uint64_t rays, std::uint64_t seed);

/// Surface of revolution with `rings` radii along z and `around` steps, closed at both ends by a fan; consists of
/// needles for very different numbers of steps and rings. Fronts outside; fits the unit cube around 0.
tracer::Mesh lathe(std::uint32_t around, std::uint32_t rings);
/// Twelve triangles, 1 x 0.7 x 0.4. Fronts outside.
tracer::Mesh box();

}  // namespace leaks
