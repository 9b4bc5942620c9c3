#pragma once
/// Ranges of a surface patch: the visibility of a light from all its points, and the radiance that it sends to the
/// camera.

#include <span>

#include "tracer/src/certify/scene_bounds.h"
#include "tracer/src/certify/surface_patch.h"

namespace tracer {

/// Range of the fraction of the light that arrives: [1, 1] if nothing lies between (an empty shaft), [0, 0] if one
/// opaque primitive blocks all segments or the light is behind the surface, else from 0 on.
Interval shadow_range(const SceneBounds& bounds, const SurfacePatch& patch, const CompiledLight& light);

/// Range over all positions of the patch, which `rays` hit; `visible` is the shadow_range() of each light.
ColorInterval shading_range(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays,
                            std::span<const Interval> visible);

}  // namespace tracer
