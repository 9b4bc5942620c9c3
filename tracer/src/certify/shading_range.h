#pragma once
/// Range of the radiance that a surface patch sends to the camera.

#include <span>

#include "tracer/src/certify/scene_bounds.h"
#include "tracer/src/certify/surface_patch.h"

namespace tracer {

/// Range over all positions of the patch, which `rays` hit; `visible` is the shadow_range() of each light.
ColorInterval shading_range(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays,
                            std::span<const Interval> visible);

}  // namespace tracer
