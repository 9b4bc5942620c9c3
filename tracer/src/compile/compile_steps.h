#pragma once
/// The steps of compile().

#include <memory>
#include <vector>

#include "tracer/compile.h"
#include "tracer/src/compile/scene_cache_entry.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/textures/image_map.h"

namespace tracer {

/// Sets the color space of textures used as normal maps to linear if they have none. A texture that is also used as a
/// color or a height is unchanged, and normal maps use a copy appended to `textures`.
void read_normal_maps_as_linear(const Background& background, std::vector<Material>& materials,
                                std::vector<Texture>& textures);

using TextureImages = std::vector<std::shared_ptr<const ImageMap>>;

/// Decodes the image files of textures to mip maps: one element per texture, null for patterns; textures of the same
/// file in the same color space share one image. Uses the cache unless `cache_entry` is null, and counts in
/// `cache_hits`. Fails with `bad_asset`, and between two files with `cancelled`.
Result<TextureImages, Failure> texture_images(const std::vector<Texture>& textures, const std::vector<Asset>& assets,
                                              const Assets& content, const RenderControl& control,
                                              SceneCacheEntry* cache_entry, CacheHits& cache_hits);

/// Converts instanced scene objects to render-space primitives. Also fills `compiled`'s table of objects, which must be
/// empty. Objects are numbered after instancing, in document order. `taken`: the scene's objects, whose meshes are
/// moved into the geometry; null: they are copied. Incomplete after cancellation.
GeometrySet build_geometry(const Scene& scene, CompiledScene& compiled, std::vector<Object>* taken,
                           const RenderControl& control);

/// Renders the depth maps that replace shadow rays (Approximations::Shadows::map): one per light, empty if the light
/// casts no shadow. `finite` are the world-space bounds of all finite shapes. Runs on the calling thread's oneTBB
/// arena; after cancellation it returns early with meaningless maps. Throws std::bad_alloc.
std::vector<ShadowMap> render_shadow_maps(const CompiledScene& scene, const Bounds& finite,
                                          const RenderControl& control);

}  // namespace tracer
