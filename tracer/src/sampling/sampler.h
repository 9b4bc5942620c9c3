#pragma once
/// The samplers of a render: each selects samples, lets integrators trace them, and states the error that is left.

#include "tracer/render.h"
#include "tracer/src/integrators/tracer.h"

namespace tracer {

/// Takes the same number of samples in every pixel. Precondition: the scene has a fixed number of samples. Throws
/// std::bad_alloc.
Result<Rendered, Failure> sample_uniformly(const CompiledScene& scene, const RenderSettings& settings,
                                           RenderControl& control, const MakeTracer& make = make_wavefront);

/// Takes samples where they lower the error most, until the target error is reached or the time budget is used up.
///
/// 1. Pilots: one sample in the middle of every pixel (pilot.h).
/// 2. Parts of the scene that are too thin for these are projected onto the image (subpixel_features.h).
/// 3. Both sort the pixels into classes (pixel_classes.h).
/// 4. Tile by tile the pixels get as many samples as their class needs (class_allocation.h, tile_sets.h), in scattered
///    order and in steps: after each step the classes are better known (refinement.h).
/// 5. Rounds with further samples follow if the error is still larger than the target.
///
/// Precondition: the scene has adaptive samples. Throws std::bad_alloc.
Result<Rendered, Failure> sample_adaptively(const CompiledScene& scene, const RenderSettings& settings,
                                            RenderControl& control, const MakeTracer& make = make_wavefront);

}  // namespace tracer
