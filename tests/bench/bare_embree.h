#pragma once
/// The yardstick: Embree and nothing else, tracing given rays against a compiled scene's geometry. No shading, no
/// queues, Embree's own triangles, textbook callbacks for the other shapes (bare_shapes.h). What it cannot do and the
/// tracer does: exact hits, scenes far from the origin, planes without an end.

#include <cstdint>
#include <memory>
#include <span>

#include "tests/bench/recorded_rays.h"

namespace bench {

/// Of all threads of this process since it began.
double processor_seconds();

class BareEmbree {
 public:
  /// `geometry` outlives this.
  explicit BareEmbree(const tracer::GeometrySet& geometry);
  ~BareEmbree();

  struct Timing {
    double seconds = 0;
    std::size_t hits = 0;
  };
  enum class Flags { as_asked, coherent };
  /// The rays of all queries of that kind, each query's in packets of 16 of their own. The packets are filled
  /// beforehand: only the calls to Embree are timed.
  [[nodiscard]] Timing trace(std::span<const Query> queries, Query::Kind kind, Flags flags) const;
  /// Its tree, and the geometry as given: vertices as floats.
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

}  // namespace bench
