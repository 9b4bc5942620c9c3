#pragma once
/// The reference for rays_bench: Embree alone, intersecting given rays with the spheres, triangles and planes of a
/// compiled scene. No shading, no queues, Embree's own spheres and triangles. Unlike the tracer it has no
/// double-precision hits, no support for scenes far from the origin and no infinite planes.

#include <cstdint>
#include <memory>
#include <span>

#include "tests/bench/recorded_rays.h"

namespace bench {

/// CPU time of all threads of this process so far.
double processor_seconds();

class BareEmbree {
 public:
  /// `geometry` must outlive this object and have no quadrics.
  explicit BareEmbree(const tracer::GeometrySet& geometry);
  ~BareEmbree();

  enum class Flags { as_recorded, coherent };
  /// Traces the rays of all queries of `kind`; no packet of 16 holds rays of two queries. The packets are filled in
  /// advance: only the calls of Embree are timed.
  [[nodiscard]] double trace_seconds(std::span<const Query> queries, Query::Kind kind, Flags flags) const;
  /// Size of the BVH and of the geometry, in floats.
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

}  // namespace bench
