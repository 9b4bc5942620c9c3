#pragma once
/// Takes the same number of samples in every pixel.

#include "tracer/render.h"
#include "tracer/src/integrators/tracer.h"

namespace tracer {

/// Precondition: the scene has a fixed number of samples. Throws std::bad_alloc.
Result<Rendered, Failure> sample_uniformly(const CompiledScene& scene, const RenderSettings& settings,
                                           RenderControl& control, const MakeTracer& make = make_wavefront);

}  // namespace tracer
