#pragma once
/// Input and by-products of a tracer: a batch of samples, and the radiance that a tracer omitted from each of them.

#include <cstdint>
#include <vector>

#include "tracer/src/math/vec.h"

namespace tracer {

/// Samples of the image that are traced together, one camera ray each. The vectors are parallel to `samples`.
struct Batch {
  /// Seeds of a sample's random choices.
  struct Sample {
    std::uint64_t key = 0;    ///< hash of the pixel
    std::uint32_t index = 0;  ///< index among the pixel's samples
  };
  std::vector<Sample> samples;
  std::vector<double> x, y;        ///< position in the full image, in pixels
  std::vector<Vec2> lens;          ///< position on the lens, in [0,1)^2; empty in scenes without a lens
  std::vector<double> share;       ///< fraction of the pixel's width; empty in scenes without filtered textures
  std::uint32_t light_points = 1;  ///< points per area light at hits of camera rays; later bounces use one

  /// Empties the batch and keeps its memory.
  void clear() {
    samples.clear();
    x.clear();
    y.clear();
    lens.clear();
    share.clear();
    light_points = 1;
  }
};

/// Upper bound of the radiance omitted from a sample (maximum over RGB), by cause.
struct OmittedRadiance {
  float depth = 0;   ///< throughput of the rays that `max_depth` terminated
  float cutoff = 0;  ///< throughput of the rays that `cutoff` terminated
  float culled = 0;  ///< radiance of culled shadow rays

  OmittedRadiance& operator+=(const OmittedRadiance& other) {
    depth += other.depth;
    cutoff += other.cutoff;
    culled += other.culled;
    return *this;
  }
  OmittedRadiance operator*(float factor) const { return {depth * factor, cutoff * factor, culled * factor}; }
};

}  // namespace tracer
