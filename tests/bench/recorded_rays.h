#pragma once
/// What the tracer asked its accelerator, ray by ray: the work of an image, to be done again by others. Only in
/// programs that are linked with the wrapping of Accelerator's two queries (CMakeLists.txt).

#include <cmath>
#include <vector>

#include "tracer/src/accel/accelerator.h"

namespace bench {

/// One call, with a copy of its rays.
class Query {
 public:
  enum class Kind { intersect, occluded };

  Query(Kind kind, const tracer::RaySpan& rays, tracer::Coherence coherence, tracer::GeometryMask mask);
  [[nodiscard]] tracer::RaySpan rays() const;
  /// Some are only in the span to keep their place: their end is not a number.
  [[nodiscard]] static bool is_ray(const tracer::RaySpan& rays, std::size_t ray) {
    return rays.t_max == nullptr || !std::isnan(rays.t_max[ray]);
  }

  Kind kind;
  tracer::Coherence coherence;
  tracer::GeometryMask mask;  ///< of an occluded query: opaque

 private:
  std::vector<double> component_[6], t_max_;
  std::vector<tracer::PrimitiveRef> from_;
  std::size_t count_;
};

/// While one lives, all that is asked is kept in it, in order. One at a time, and one thread that asks.
class Recording {
 public:
  Recording();
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  std::vector<Query> queries;
};

}  // namespace bench
