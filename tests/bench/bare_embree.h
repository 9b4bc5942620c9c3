#pragma once
/// The reference for rays_bench: Embree alone, intersecting given rays with the geometry of a compiled scene. No
/// shading, no queues, Embree's own triangles, textbook callbacks for the other shapes (bare_shapes.h). Unlike the
/// tracer it has no double-precision hits, no support for scenes far from the origin and no infinite planes.

#include <cstdint>
#include <memory>
#include <span>

#include "tests/bench/recorded_rays.h"

namespace bench {

/// CPU time of all threads of this process so far.
double processor_seconds();

class BareEmbree {
 public:
  /// `geometry` must outlive this object.
  explicit BareEmbree(const tracer::GeometrySet& geometry);
  ~BareEmbree();

  struct Timing {
    double seconds = 0;
    std::size_t hits = 0;
  };
  enum class Flags { as_recorded, coherent };
  /// Traces the rays of all queries of `kind`; no packet of 16 holds rays of two queries. The packets are filled in
  /// advance: only the calls of Embree are timed.
  [[nodiscard]] Timing trace(std::span<const Query> queries, Query::Kind kind, Flags flags) const;
  /// Size of the BVH and of the geometry, with float vertices.
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

}  // namespace bench
