#pragma once
/// Steps of compile().

#include <functional>
#include <optional>
#include <vector>

#include "tracer/compile.h"
#include "tracer/src/compile/patch_points.h"
#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// References must outlive it.
struct BuildContext {
  RenderControl& control;
  SceneCacheEntry* cache_entry = nullptr;     ///< null: nothing is cached
  const std::function<double()>& elapsed_ms;  ///< time since the start of a time budget; empty: none is kept
};

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

/// Points on diffuse surfaces, in the view or a few bounces away. Runs on the calling thread's oneTBB arena; incomplete
/// after cancellation. Throws std::bad_alloc.
std::vector<PatchPoint> points_in_view(const CompiledScene& scene, const RenderControl& control);

/// Finds the parts of the sky that are seen from the points, which a black sky does not need. None if they see most of
/// it, or nothing. Runs on the calling thread's oneTBB arena; incomplete after cancellation. Throws std::bad_alloc.
SkyOpenings find_sky_openings(const CompiledScene& scene, const std::function<std::vector<PatchPoint>()>& find_points,
                              const RenderControl& control);

/// From now on rays toward emitters meet the openings, too. Precondition: the accelerator and the background are set.
void sample_sky_openings(CompiledScene& scene, const SkyOpenings& openings);

/// Divides the surfaces that reflect diffusely into patches, and solves for the light that arrives at each
/// (Approximations::Interreflection), with more patches and rays until paths at some points show that the error is
/// within its share of the target, until a limit is reached, or until more would not pay. Sets the scene's light of
/// patches, the same for every view; it stays null if no surface has patches. Precondition: the scene is complete
/// otherwise. Runs on the calling thread's oneTBB arena; after cancellation the result is meaningless. Fails with
/// `cancelled` while another scene builds the same. Throws std::bad_alloc.
std::optional<Failure> solve_radiosity(CompiledScene& scene, const Bounds& finite, const BuildContext& context);

}  // namespace tracer
