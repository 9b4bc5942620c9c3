#pragma once
/// Finds what rays meet. The one place that knows Embree is behind this header.

#include <cstddef>
#include <cstdint>
#include <memory>

#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/result.h"
#include "tracer/src/accel/geometry.h"

namespace tracer {

/// `count` rays as arrays, trace frame, unit directions. A ray covers the distances (0, t_max); `t_max` null: no end.
/// `from` is the primitive each ray starts on, or none; flat ones (triangles, planes) are not met again by a ray that
/// leaves them, whatever rounding says. Null: no ray starts on anything. A ray with a component that is NaN or infinite
/// meets nothing.
struct RaySpan {
  const double *ox, *oy, *oz;
  const double *dx, *dy, *dz;
  const double* t_max;
  const PrimitiveRef* from;
  std::size_t count;
};

/// Where the answers go, `count` each. `u`, `v` are the barycentric coordinates of triangles: weights of their second
/// and third vertex.
struct HitSpan {
  PrimitiveRef* primitive;
  double* t;
  double *u, *v;
};

/// Coherent: neighbours in the span go roughly the same way. It changes the speed, never the answer.
enum class Coherence { coherent, incoherent };

/// Which surfaces a query sees.
enum class GeometryMask { all, opaque, transmissive };

class Accelerator {
 public:
  /// Owns what it is built over. Fails with `cancelled`, `out_of_memory` or, where Embree does, `internal`.
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
  [[nodiscard]] std::uint64_t memory_bytes() const;  ///< its geometry's included

 private:
  struct Embree;
  Accelerator(GeometrySet geometry, std::unique_ptr<Embree> embree);

  const GeometrySet geometry_;  ///< Embree points into it
  std::unique_ptr<Embree> embree_;
};

}  // namespace tracer
