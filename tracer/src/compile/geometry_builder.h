#pragma once
/// Turns placed objects into what rays meet.

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// Fills `compiled`'s material_of_object and axes_of_object beside it. Objects are numbered as placed: instances
/// counted out, in the document's order. `taken`: the scene's own objects, of whose meshes the vertices and triangles
/// are to become the geometry's; null: they are copied. Precondition: `compiled` has nothing of it yet. Incomplete once
/// `control` is cancelled.
GeometrySet build_geometry(const Scene& scene, CompiledScene& compiled, std::vector<Object>* taken,
                           const RenderControl& control);

}  // namespace tracer
