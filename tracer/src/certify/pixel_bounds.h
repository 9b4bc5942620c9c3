#pragma once
/// Proven intervals of the radiance of pixels, without any sample: nothing in the scene, however small or bright, can
/// be missed in a pixel with a narrow one.
///
/// Blocks of 32 pixels are divided until one surface or the background covers them, or down to a pixel. The radiance of
/// a covered block is bounded by affine arithmetic over its positions (affine_form.h), the visibility of lights by
/// shafts from the surface to the light (shading_range.h). Textures, mirrors, glass and what else light does on its way
/// count with their largest effect, so that certify needs no second copy of them. Conservative beams have a long
/// history (Amanatides 1984, "Ray Tracing with Cones"; Haines, Wallace 1991, "Shaft Culling"; Mitchell 1990, "Robust
/// Ray Intersection with Interval Arithmetic").

#include <array>
#include <cstddef>
#include <functional>

#include "tracer/control.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {

/// Interval that contains the radiance of every sample of a pixel, by channel, rounded outward. `high` may be infinite.
///
/// A sample is what the integrator returns for any position in the pixel's closed square, any point of the lens and of
/// the lights, and any share of the pixel's width, without approximations, with any `max_depth` and `cutoff`. Only
/// Russian roulette may exceed it, by rays that survive with a larger throughput. Its mean does not.
struct RadianceInterval {
  std::array<float, 3> low{}, high{};
};

/// Calls use(place, interval) for each pixel of the image's window, numbered row by row, from any thread; not for all
/// of them if cancelled. The same for any number of threads. When `hurry` returns true the rest get the interval of the
/// whole scene. Throws std::bad_alloc.
void bound_pixels(const CompiledScene& scene, const InParallel& in_parallel, const RenderControl& control,
                  const std::function<bool()>& hurry,
                  const std::function<void(std::size_t place, const RadianceInterval& interval)>& use);

}  // namespace tracer
