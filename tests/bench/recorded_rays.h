#pragma once
/// Recording of the queries that the tracer sends to its accelerator, for replay. Works only in programs linked with
/// wrapped Accelerator queries (CMakeLists.txt).

#include <cmath>
#include <vector>

#include "tracer/src/accel/accelerator.h"

namespace bench {

/// One call and a copy of its rays.
class Query {
 public:
  enum class Kind { intersect, occluded };

  Query(Kind kind, const tracer::RaySpan& rays, tracer::Coherence coherence, tracer::GeometryMask mask);
  [[nodiscard]] tracer::RaySpan rays() const;
  /// False for inactive lanes of a span: their t_max is NaN.
  [[nodiscard]] static bool is_ray(const tracer::RaySpan& rays, std::size_t ray) {
    return rays.t_max == nullptr || !std::isnan(rays.t_max[ray]);
  }

  Kind kind;
  tracer::Coherence coherence;
  tracer::GeometryMask mask;  ///< opaque for occluded queries

 private:
  std::vector<double> component_[6], t_max_;
  std::vector<tracer::PrimitiveRef> from_;
  std::size_t count_;
};

/// Collects all queries in order while the object exists. One recording at a time, and only one rendering thread.
class Recording {
 public:
  Recording();
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  std::vector<Query> queries;
};

}  // namespace bench
