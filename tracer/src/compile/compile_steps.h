#pragma once
/// Steps of compile().

#include <memory>
#include <vector>

#include "tracer/compile.h"
#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// Converts instanced scene objects to render-space primitives. Also fills `compiled`'s table of objects, which must be
/// empty. Objects are numbered after instancing, in document order. `taken`: the scene's objects, whose meshes are
/// moved into the geometry; null: they are copied. Incomplete after cancellation.
GeometrySet build_geometry(const Scene& scene, CompiledScene& compiled, std::vector<Object>* taken,
                           const RenderControl& control);

/// Leaves out primitives and meshes that equal an earlier one, and sets `duplicates` and `mesh_has_normals`. Of hits at
/// equal distance the first primitive wins, so no ray hits them. Thousands at one place would cost every ray there as
/// many tests.
void drop_duplicates(GeometrySet& geometry);

/// Renders the depth maps that replace shadow rays (Approximations::Shadows::map): one per light, empty if the light
/// casts no shadow. `finite` are the world-space bounds of all finite shapes. Runs on the calling thread's oneTBB
/// arena; after cancellation it returns early with meaningless maps. Throws std::bad_alloc.
std::vector<ShadowMap> render_shadow_maps(const CompiledScene& scene, const Bounds& finite,
                                          const RenderControl& control);

/// Divides the surfaces that reflect diffusely into patches and solves for the light that arrives at each
/// (Approximations::Interreflection). Precondition: the scene is complete otherwise. Runs on the calling thread's
/// oneTBB arena; after cancellation the result is meaningless. Throws std::bad_alloc.
std::shared_ptr<const Radiosity> solve_radiosity(CompiledScene& scene, const Bounds& finite,
                                                 const RenderControl& control);

}  // namespace tracer
