#pragma once
/// What rays meet, as the accelerator keeps it: structure-of-arrays values in the trace frame. No Embree type here.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tracer/src/shapes/analytic_shape.h"

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

/// Triangles that share vertices. All are double-precision user geometry: Embree sees padded boxes and what is a hit is
/// decided in double on these positions (triangle_hit.h), so needles and meshes that are small in their scene are as
/// right as any, and nothing leaks. There is no choice of Embree's own float triangles for some meshes, because it pays
/// in no case. Open terrains without needles, where they could be chosen, a sunlit image of 1280 x 720, seconds of
/// one AVX-512 core to build and to trace, in pairs (triangle_pairs.h) and as Embree's own with its robust flag:
///
///        97,000 triangles   0.03 + 0.13    0.03 + 0.13
///       980,000             0.25 + 0.22    0.25 + 0.20
///     3,920,000             0.92 + 0.37    1.07 + 0.30
///
/// For that tenth of the time closed meshes would leak (10^-3 of the rays aimed at vertices, and still 10^-6 when each
/// triangle is grown by far more than its rounding), and images would depend on the machine: which of two triangles a
/// ray meets near their edge is up to Embree's instruction set, one pixel of each of these.
struct TriangleGeometry {
  std::vector<Vec3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<float, 3>> normals;      ///< per vertex, unit; empty: flat
  std::vector<std::array<double, 2>> uvs;         ///< per vertex; empty: (0,0), (1,0), (0,1)
  std::vector<std::uint32_t> object_of_triangle;  ///< empty: all belong to `object`
  std::uint32_t object = 0;
  bool transmissive = false;

  [[nodiscard]] const Vec3& position(std::uint32_t vertex) const { return positions[vertex]; }
};

/// Analytic shapes other than the spheres above, which a transform may have made ellipsoids; either all opaque or all
/// transmissive.
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

std::uint64_t memory_bytes(const GeometrySet& set);
/// Upper bound of the transmissive surfaces that a straight line crosses: twice the hits of each primitive, which
/// leaves room for rounding. A ray that continues after so many is trapped where a solid is thinner than the last bit
/// of its coordinates, as a cone with a height of 10^19 times its radius is, and would never leave.
std::uint64_t max_transmissive_hits(const GeometrySet& set);

}  // namespace tracer
