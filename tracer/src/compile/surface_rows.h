#pragma once
/// Surfaces as patches, and the transport of light between these.

#include <array>
#include <cstdint>
#include <vector>

#include "tracer/control.h"
#include "tracer/src/compile/patch_points.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/radiosity/patches.h"
#include "tracer/src/radiosity/transport.h"

namespace tracer {

struct SurfacePatches {
  PatchGrid grid;
  std::vector<std::vector<PatchPoint>> points;  ///< by patch: some 16, uniform over its area
  bool limited = false;                         ///< fewer or larger patches than requested
};

/// Divides the surfaces into about `wanted` patches: more, because those at borders are cut, but at most
/// `patches_max`. If there are too many, they are made larger. Where that does not suffice, as with many small objects,
/// parts of the surfaces have no patch. Empty if light reaches no surface that reflects diffusely. Incomplete after
/// cancellation. Throws std::bad_alloc.
SurfacePatches divide_surfaces(const PatchPoints& surfaces, double wanted, std::uint32_t patches_max,
                               const RenderControl& control);

struct SurfaceRows {
  std::array<Transport, 2> halves;  ///< by the first and the second half of the rays
  std::uint64_t rays = 0;
};

/// The rows of all patches: light from patches, directly or by mirrors and glass, and from the background, emitters and
/// lights that these show. An entry is the light that rays bring from a patch, divided by their number, half of
/// `row_rays`. Precondition: `scene` has the grid of the patches. Incomplete after cancellation. Throws std::bad_alloc.
SurfaceRows trace_rows(const CompiledScene& scene, const std::vector<std::vector<PatchPoint>>& points,
                       std::uint32_t row_rays, RenderControl& control);

}  // namespace tracer
