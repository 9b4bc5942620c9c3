#pragma once
/// Ray-scene intersection and its geometry, without Embree types. The only directory that includes Embree.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/result.h"
#include "tracer/src/math/rounding.h"
#include "tracer/src/shapes/analytic_shape.h"

namespace tracer {

// Geometry: structures of arrays in render space.

/// Primitive of a GeometrySet. Geometries are numbered in the order of its members: spheres, triangles, quadrics,
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

  [[nodiscard]] std::size_t size() const { return x.size(); }
  [[nodiscard]] std::uint32_t object_of(std::uint32_t sphere) const { return object[sphere]; }
  [[nodiscard]] Vec3 center(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// The place at which flat_polygon evaluates the light of a polygon.
struct PolygonCenter {
  BoundedPoint point;
  Vec3 normal;  ///< unit
};

/// Triangles that share vertices. All are double-precision user geometry: Embree traverses padded boxes and hits are
/// computed in double from these positions (triangle_pairs.h), so needles and meshes that are small in their scene are
/// exact, and nothing leaks. Embree's own float triangles are not used for any mesh, because they save little even for
/// open terrains without needles. A sunlit image of 1280 x 720, seconds of one AVX-512 core to build and to trace, in
/// pairs and as Embree's own triangles with its robust flag:
///
///        97,000 triangles   0.03 + 0.13    0.03 + 0.13
///       980,000             0.25 + 0.22    0.25 + 0.20
///     3,920,000             0.92 + 0.37    1.07 + 0.30
///
/// In exchange for that tenth of the time closed meshes would leak (10^-3 of the rays aimed at vertices, and still
/// 10^-6 if each triangle is grown by far more than its rounding), and images would depend on the machine: near a
/// shared edge Embree's instruction set decides which of two triangles is hit, in one pixel of each of these images.
struct TriangleGeometry {
  std::vector<Vec3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<float, 3>> normals;      ///< per vertex, unit; empty: flat
  std::vector<std::array<double, 2>> uvs;         ///< per vertex; empty: (0,0), (1,0), (0,1)
  std::vector<std::uint32_t> object_of_triangle;  ///< empty: all belong to `object`
  std::vector<PolygonCenter> polygon_centers;     ///< by triangle; empty: each is its own polygon, or none is needed
  std::uint32_t object = 0;
  bool transmissive = false;

  [[nodiscard]] std::size_t size() const { return triangles.size(); }
  [[nodiscard]] const Vec3& position(std::uint32_t vertex) const { return positions[vertex]; }
  [[nodiscard]] Vec3 normal(std::uint32_t vertex) const {
    const auto& [x, y, z] = normals[vertex];
    return {x, y, z};
  }
  [[nodiscard]] std::uint32_t object_of(std::uint32_t triangle) const {
    return object_of_triangle.empty() ? object : object_of_triangle[triangle];
  }
};

/// Analytic shapes other than the spheres above, and ellipsoids; either all opaque or all transmissive.
struct QuadricGeometry {
  std::vector<Quadric> quadrics;
  std::vector<std::uint32_t> object;
  bool transmissive = false;

  [[nodiscard]] std::size_t size() const { return quadrics.size(); }
  [[nodiscard]] std::uint32_t object_of(std::uint32_t quadric) const { return object[quadric]; }
};

/// Infinite planes: they fit in no BVH, so every ray is intersected with each of them.
struct PlaneGeometry {
  std::vector<Vec3> point;
  std::vector<Vec3> normal;  ///< unit
  std::vector<std::uint32_t> object;
  std::vector<std::uint8_t> transmissive;

  [[nodiscard]] std::size_t size() const { return point.size(); }
  [[nodiscard]] std::uint32_t object_of(std::uint32_t plane) const { return object[plane]; }
};

enum class GeometryKind { spheres, triangles, quadrics, planes };

struct GeometrySet {
  std::vector<SphereGeometry> spheres;
  std::vector<TriangleGeometry> triangles;
  std::vector<QuadricGeometry> quadrics;
  PlaneGeometry planes;
  std::uint64_t duplicates = 0;        ///< primitives left out because they equal an earlier one
  std::vector<bool> mesh_has_normals;  ///< by placed mesh, in document order, with those left out

  [[nodiscard]] std::uint32_t first_triangles() const { return static_cast<std::uint32_t>(spheres.size()); }
  [[nodiscard]] std::uint32_t first_quadrics() const {
    return first_triangles() + static_cast<std::uint32_t>(triangles.size());
  }
  [[nodiscard]] std::uint32_t plane_geometry() const {
    return first_quadrics() + static_cast<std::uint32_t>(quadrics.size());
  }

  /// The vector that contains the geometry with this number, and its element.
  [[nodiscard]] GeometryKind kind_of(std::uint32_t geometry) const {
    return geometry < first_triangles()  ? GeometryKind::spheres
           : geometry < first_quadrics() ? GeometryKind::triangles
           : geometry < plane_geometry() ? GeometryKind::quadrics
                                         : GeometryKind::planes;
  }
  [[nodiscard]] const TriangleGeometry& mesh(std::uint32_t geometry) const {
    return triangles[geometry - first_triangles()];
  }
  [[nodiscard]] const QuadricGeometry& quadric_set(std::uint32_t geometry) const {
    return quadrics[geometry - first_quadrics()];
  }
  /// Returns use(geometry), which has the same type for all kinds.
  template <class Use>
  auto visit(std::uint32_t geometry, const Use& use) const {
    switch (kind_of(geometry)) {
      case GeometryKind::spheres:
        return use(spheres[geometry]);
      case GeometryKind::triangles:
        return use(mesh(geometry));
      case GeometryKind::quadrics:
        return use(quadric_set(geometry));
      case GeometryKind::planes:
        break;
    }
    return use(planes);
  }
  [[nodiscard]] std::size_t primitive_count(std::uint32_t geometry) const {
    return visit(geometry, [](const auto& one) { return one.size(); });
  }
  [[nodiscard]] std::uint32_t object_of(const PrimitiveRef& primitive) const {
    return visit(primitive.geometry, [&](const auto& one) { return one.object_of(primitive.primitive); });
  }
};

inline std::uint64_t memory_bytes(const GeometrySet& set) {
  const auto bytes_of = [](const auto& values) { return values.capacity() * sizeof(values[0]); };
  std::uint64_t bytes = 0;
  for (const SphereGeometry& s : set.spheres)
    bytes += bytes_of(s.x) + bytes_of(s.y) + bytes_of(s.z) + bytes_of(s.radius) + bytes_of(s.object);
  for (const QuadricGeometry& q : set.quadrics) bytes += bytes_of(q.quadrics) + bytes_of(q.object);
  for (const TriangleGeometry& t : set.triangles)
    bytes += bytes_of(t.positions) + bytes_of(t.triangles) + bytes_of(t.normals) + bytes_of(t.uvs) +
             bytes_of(t.object_of_triangle) + bytes_of(t.polygon_centers);
  return bytes;
}

/// `count` rays as arrays, in render space, with unit directions. A ray covers the distances (0, t_max), or (0,
/// infinity) if `t_max` is null. `from` is the primitive each ray starts on, or none: a ray never hits the flat
/// primitive (triangle or plane) that it starts on, whatever the rounding. Null: no ray starts on a primitive. A ray
/// with a component that is NaN or infinite hits nothing.
struct RaySpan {
  const double *ox, *oy, *oz;
  const double *dx, *dy, *dz;
  const double* t_max;
  const PrimitiveRef* from;
  std::size_t count;
};

/// Output arrays of `count` hits. `u`, `v` are the barycentric coordinates of triangles: weights of their second and
/// third vertex.
struct HitSpan {
  PrimitiveRef* primitive;
  double* t;
  double *u, *v;
};

/// Coherent: neighbors in the span have similar directions. Changes the speed, never the result.
enum class Coherence { coherent, incoherent };

/// Geometry that a query is tested against, as bits. Transmissive geometry does not occlude.
enum class GeometryMask : unsigned { opaque = 1, transmissive = 2, all = 3 };

class Accelerator {
 public:
  /// Owns the geometry. Fails with `cancelled`, `out_of_memory` or, where Embree fails, `internal`.
  static Result<std::shared_ptr<const Accelerator>, Failure> build(GeometrySet geometry, RenderControl& control);
  ~Accelerator();
  Accelerator(Accelerator&&) = delete;

  /// The nearest hit of every ray. Of hits at equal distance the lowest (geometry, primitive) wins, so the image does
  /// not depend on how the BVH was built.
  void intersect(const RaySpan& rays, const HitSpan& hits, Coherence coherence,
                 GeometryMask mask = GeometryMask::all) const;

  /// blocked[i] = 1 where an opaque surface lies within the ray.
  void occluded(const RaySpan& rays, std::uint8_t* blocked, Coherence coherence) const;

  [[nodiscard]] const GeometrySet& geometry() const { return geometry_; }
  /// Upper bound of the transmissive surfaces that a straight line crosses: twice the hits of each primitive, which
  /// leaves room for rounding. A ray with more crossings is trapped in a solid thinner than the last bit of its
  /// coordinates, such as a cone with a height of 10^19 times its radius, and would never leave it.
  [[nodiscard]] std::uint64_t max_transmissive_hits() const { return max_transmissive_hits_; }
  [[nodiscard]] std::uint64_t memory_bytes() const;  ///< including the geometry

 private:
  struct Embree;
  Accelerator(GeometrySet geometry, std::unique_ptr<Embree> embree);

  const GeometrySet geometry_;  ///< Embree keeps pointers into it
  const std::uint64_t max_transmissive_hits_;
  std::unique_ptr<Embree> embree_;
};

}  // namespace tracer
