#pragma once
/// What rays meet, as the accelerator keeps it: structure-of-arrays values in the trace frame. No Embree type here.

#include <array>
#include <cstdint>
#include <vector>

#include "tracer/src/accel/quadric.h"

namespace tracer {

/// Which primitive a ray met. Geometries are numbered in the order of GeometrySet's vectors: spheres, triangles,
/// planes.
struct PrimitiveRef {
  static constexpr std::uint32_t none = 0xffffffffu;
  std::uint32_t geometry = none;
  std::uint32_t primitive = none;
  [[nodiscard]] bool hit() const { return geometry != none; }
  auto operator<=>(const PrimitiveRef&) const = default;
};

/// Spheres that share one Embree geometry; they are either all opaque or all transmissive.
struct SphereGeometry {
  std::vector<double> x, y, z, radius;
  std::vector<std::uint32_t> object;
  bool transmissive = false;
};

/// Triangles that share vertices. Positions are floats and *are* the geometry: hits are refined in double against
/// exactly these, so what Embree traverses and what is shaded agree.
struct TriangleGeometry {
  std::vector<float> positions;  ///< x,y,z per vertex, and 4 spare floats that Embree may read beyond the end
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<float, 3>> normals;      ///< per vertex, unit; empty: flat
  std::vector<std::array<double, 2>> uvs;         ///< per vertex; empty: (0,0), (1,0), (0,1)
  std::vector<std::uint32_t> object_of_triangle;  ///< empty: all belong to `object`
  std::uint32_t object = 0;
  bool transmissive = false;

  [[nodiscard]] Vec3 position(std::uint32_t vertex) const {
    const float* p = positions.data() + 3 * static_cast<std::size_t>(vertex);
    return {p[0], p[1], p[2]};
  }
};

/// Discs, cylinders, cones, boxes, and spheres that a transform made ellipsoids; either all opaque or all transmissive.
struct QuadricGeometry {
  std::vector<Quadric> quadrics;
  std::vector<std::uint32_t> object;
  bool transmissive = false;
};

/// Infinite planes: no BVH can hold them, so they are tried one after the other for every ray.
struct PlaneGeometry {
  std::vector<Vec3> point;
  std::vector<Vec3> normal;  ///< unit
  std::vector<std::uint32_t> object;
  std::vector<std::uint8_t> transmissive;
};

struct GeometrySet {
  std::vector<SphereGeometry> spheres;
  std::vector<TriangleGeometry> triangles;
  std::vector<QuadricGeometry> quadrics;
  PlaneGeometry planes;

  [[nodiscard]] std::uint32_t first_triangles() const { return static_cast<std::uint32_t>(spheres.size()); }
  [[nodiscard]] std::uint32_t first_quadrics() const {
    return first_triangles() + static_cast<std::uint32_t>(triangles.size());
  }
  [[nodiscard]] std::uint32_t plane_geometry() const {
    return first_quadrics() + static_cast<std::uint32_t>(quadrics.size());
  }
};

}  // namespace tracer
