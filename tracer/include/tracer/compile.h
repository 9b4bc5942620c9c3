#pragma once
/// Compiles a scene for tracing: geometry recentred and scaled by a power of two, its BVH, decoded textures, lights.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "tracer/control.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// Immutable and opaque; any number of renders on any threads may share one.
class CompiledScene;
class SceneCacheEntry;

/// Reason why a compile or render has no result.
struct Failure {
  enum class Code { cancelled, out_of_memory, bad_asset, internal };
  Code code = Code::internal;
  std::string detail;     ///< a sentence for people; for bad_asset it begins with the asset's name
  std::string pointer{};  ///< bad_asset: JSON pointer of the field that names the asset
};

/// Precondition: `validate` returned no issue, and mesh files have been read into `scene`. Expensive; the result may be
/// rendered many times. Keeps no reference to `scene`. Runs on the calling thread's oneTBB arena. Fails with
/// `cancelled` after `control.cancel()`, `out_of_memory` if Embree or the heap has none left, `bad_asset` if an asset
/// is not an image within TextureImageLimits, or too bright for the light model. With `cache_entry` (scene_cache.h,
/// acquired for this scene), cached parts are reused and new parts are stored. `elapsed_ms`: as in RenderSettings; with
/// a time budget, the light of patches takes a part of it at most.
Result<std::shared_ptr<const CompiledScene>, Failure> compile(const Scene& scene, RenderControl& control,
                                                              const Assets& assets = {},
                                                              SceneCacheEntry* cache_entry = nullptr,
                                                              const std::function<double()>& elapsed_ms = {});

/// Like compile, but moves the meshes out of `scene.objects`, also if it fails: it avoids a second copy of them in
/// memory while the BVH is built. The rest of `scene` is unchanged.
Result<std::shared_ptr<const CompiledScene>, Failure> compile_taking_meshes(
    Scene& scene, RenderControl& control, const Assets& assets = {}, SceneCacheEntry* cache_entry = nullptr,
    const std::function<double()>& elapsed_ms = {});

/// Parts of a compiled scene that came from a SceneCache.
struct CacheHits {
  bool geometry = false;               ///< shapes, mesh files and BVH
  std::uint32_t textures = 0;          ///< texture images from the cache
  std::uint32_t decoded_textures = 0;  ///< texture images decoded for this scene
  bool radiosity = false;              ///< the light of patches
};
CacheHits cache_hits(const CompiledScene& scene);

/// The linear system that stands for light between surfaces (Approximations::Interreflection).
struct RadiosityFigures {
  std::uint32_t patches = 0;
  bool limited = false;  ///< Limits::radiosity_patches or memory made patches or rays fewer than the target requires
  std::uint32_t stages = 0;   ///< solutions with more and more patches and rays, until the error suffices
  std::uint64_t rays = 0;     ///< diffuse rays from patches, and all that follow from them, of all stages
  std::uint64_t factors = 0;  ///< entries of the system
  std::uint32_t sweeps = 0;
  /// Upper bound of the error that the sweeps leave, as radiance; infinity if a patch receives all the light of others.
  double bound = 0;
};
/// None if the scene has no patches.
std::optional<RadiosityFigures> radiosity_figures(const CompiledScene& scene);

/// Bytes held by the compiled scene, including the BVH and parts shared with other scenes.
std::uint64_t memory_bytes(const CompiledScene& scene);

}  // namespace tracer
