#pragma once
/// Ray-scene intersection. The only directory that includes Embree.

#include <cstddef>
#include <cstdint>
#include <memory>

#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/result.h"
#include "tracer/src/accel/geometry.h"

namespace tracer {

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

/// Geometry that a query is tested against, as bits.
enum class GeometryMask : unsigned { opaque = 1, transmissive = 2, all = 3 };

class Accelerator {
 public:
  /// Owns the geometry. Fails with `cancelled`, `out_of_memory` or, where Embree fails, `internal`.
  static Result<std::shared_ptr<const Accelerator>, Failure> build(GeometrySet geometry, RenderControl& control);
  ~Accelerator();
  Accelerator(const Accelerator&) = delete;
  Accelerator& operator=(const Accelerator&) = delete;

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
