#pragma once
/// Renders the depth maps that replace shadow rays (Approximations::Shadows::map).

#include <vector>

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// One map per light, empty if the light casts no shadow. `finite` are the world-space bounds of all finite shapes.
/// Runs on the calling thread's oneTBB arena; after cancellation it returns early with meaningless maps. Throws
/// std::bad_alloc.
std::vector<ShadowMap> render_shadow_maps(const CompiledScene& scene, const Bounds& finite,
                                          const RenderControl& control);

}  // namespace tracer
