#pragma once
/// Makes the maps that stand in for shadow rays.

#include <vector>

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// One beside each light; empty where the light casts no shadow. `finite` holds everything finite in the scene, world.
/// Runs on the calling thread's oneTBB arena; stops early once `control` is cancelled, with maps that mean nothing.
/// Throws std::bad_alloc.
std::vector<ShadowMap> trace_shadow_maps(const CompiledScene& scene, const Bounds& finite,
                                         const RenderControl& control);

}  // namespace tracer
