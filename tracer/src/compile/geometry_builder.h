#pragma once
/// Converts instanced scene objects to render-space primitives.

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// Also fills `compiled`'s material_of_object and axes_of_object, which must be empty. Objects are numbered after
/// instancing, in document order. `taken`: the scene's objects, whose meshes are moved into the geometry; null: they
/// are copied. Incomplete after cancellation.
GeometrySet build_geometry(const Scene& scene, CompiledScene& compiled, std::vector<Object>* taken,
                           const RenderControl& control);

}  // namespace tracer
