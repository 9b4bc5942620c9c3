#pragma once
/// Proven intervals of the radiance of pixels, before any sample is taken. A pixel with a narrow interval needs one
/// sample and no validation: nothing in the scene, however small or bright, can be missed in it.
///
/// Blocks of 32 pixels are divided until one surface or the background covers them (occupancy), or down to a pixel. The
/// radiance of a covered block is bounded by affine arithmetic over its positions (affine_form.h), the visibility of
/// lights by shafts from the surface to the light (shadow_range.h). Conservative beams have a long history (Amanatides
/// 1984, "Ray Tracing with Cones"; Haines, Wallace 1991, "Shaft Culling"; Mitchell 1990, "Robust Ray Intersection with
/// Interval Arithmetic").

#include <array>
#include <vector>

#include "tracer/control.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/parallel/in_parallel.h"

namespace tracer {

/// Interval that contains the radiance of every sample of a pixel, by channel, rounded outward. `high` may be infinite.
///
/// A sample is what the integrator returns for any position in the pixel's closed square, any point of the
/// lens and of the lights, and any share of the pixel's width, without approximations or with those given, with any
/// `max_depth` and `cutoff`. Only Russian roulette may exceed it: a ray below `cutoff` that survives counts as one of
/// the throughput `cutoff`. Its mean does not.
struct RadianceInterval {
  std::array<float, 3> low{}, high{};
  /// The pixel may contain an edge or something smaller than itself: neither the background alone nor one smooth
  /// surface is proven to cover it.
  bool edge = true;
};

/// One interval per pixel of the image's window, row by row; empty if cancelled. The same for any number of threads.
/// Throws std::bad_alloc.
std::vector<RadianceInterval> bound_pixels(const CompiledScene& scene, const Approximations& approximate,
                                           const InParallel& in_parallel, const RenderControl& control);

}  // namespace tracer
