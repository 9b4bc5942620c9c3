#pragma once
/// The seam between samplers and integrators: a sampler fills a batch of samples, calls `trace()` and reads the
/// results.

#include <concepts>
#include <cstdint>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/interaction/gbuffer.h"

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

/// An integrator with the scratch memory of one thread. Results are valid until the next change of the batch.
/// - Construction: `approximations` are the scene's, or none for exact samples.
/// - `batch()`: samples to trace next. trace() does not change it.
/// - `trace()`: traces the batch. Returns false if cancelled; results are then undefined. Throws std::bad_alloc.
/// - `radiance()`: radiance of each sample; may be non-finite, which `statistics()` counts.
/// - `omitted()`: omitted radiance of each sample; empty if the scene cannot omit any.
/// - `gbuffer()`: first hits; filled if the scene needs a depth cue or layers.
/// - `statistics()`: counts of all batches so far.
template <class T>
concept Tracer = std::constructible_from<T, const CompiledScene&, const RenderControl&, const Approximations&> &&
    requires(T tracer, const T& traced) {
  { tracer.batch() } -> std::same_as<Batch&>;
  { tracer.trace() } -> std::same_as<bool>;
  { traced.radiance() } -> std::same_as<const std::vector<Color>&>;
  { traced.omitted() } -> std::same_as<const std::vector<OmittedRadiance>&>;
  { traced.gbuffer() } -> std::same_as<const GBuffer&>;
  { traced.statistics() } -> std::same_as<const RenderStatistics&>;
};

}  // namespace tracer
