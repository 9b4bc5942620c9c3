#pragma once
/// Visibility of a light from all points of a surface patch.

#include "tracer/src/certify/scene_bounds.h"
#include "tracer/src/certify/surface_patch.h"

namespace tracer {

/// Points of a light, unless it is directional.
AffineVec light_points(const CompiledLight& light);

/// Range of the fraction of the light that arrives: [1, 1] if nothing lies between (an empty shaft), [0, 0] if one
/// opaque primitive blocks all segments or the light is behind the surface, else from 0 on.
Interval shadow_range(const SceneBounds& bounds, const SurfacePatch& patch, const CompiledLight& light);

}  // namespace tracer
