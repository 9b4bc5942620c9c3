#pragma once
/// The yardstick: Embree and nothing else, tracing given rays against a compiled scene's geometry. No shading, no
/// queues, Embree's own triangles, textbook callbacks for the other shapes (bare_shapes.h). What it cannot do and the
/// tracer does: planes, exact hits, scenes far from the origin.

#include <cstdint>
#include <memory>

#include "tracer/src/accel/accelerator.h"

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
    std::size_t rays = 0, hits = 0;
  };
  /// Packets of 16 filled beforehand; only the calls to Embree are timed. Coherent flag set.
  [[nodiscard]] Timing closest(const tracer::RaySpan& rays) const;
  [[nodiscard]] Timing occluded(const tracer::RaySpan& rays) const;
  /// Its tree, and the geometry as given: vertices as floats.
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

}  // namespace bench
