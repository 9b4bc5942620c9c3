#pragma once
/// The seam between samplers and integrators: a sampler fills `batch()`, calls `trace()` and reads the results.

#include <concepts>

#include "tracer/render.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/integrators/batch.h"
#include "tracer/src/interaction/gbuffer.h"

namespace tracer {

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
