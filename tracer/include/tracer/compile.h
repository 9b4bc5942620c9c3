#pragma once
/// Turns a scene into what rays can be traced against: recentred, scaled by a power of two, with its BVH built.

#include <cstdint>
#include <memory>
#include <string>

#include "tracer/assets.h"
#include "tracer/control.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// Immutable; any number of renders on any threads may share one. Opaque: its content is the tracer's business.
class CompiledScene;
class SceneCacheEntry;

/// Why a compile or render gave nothing.
struct Failure {
  enum class Code { cancelled, out_of_memory, bad_asset, internal };
  Code code = Code::internal;
  std::string detail;     ///< a sentence for people; of a bad asset it begins with its name
  std::string pointer{};  ///< of a bad asset: the place in the document that names it
};

/// Precondition: `validate` found nothing, and meshes of files have been read. Expensive, done once; keeps no reference
/// to `scene`. Fails with `cancelled` when `control` says so, `out_of_memory` when Embree or the heap do, `bad_asset`
/// when the bytes of one are no image within the bounds that limits.h gives texture images. Runs on the calling
/// thread's oneTBB arena.
/// With a `claim` (scene_cache.h), of this scene, what an earlier one left is taken, and kept what there was not.
Result<std::shared_ptr<const CompiledScene>, Failure> compile(const Scene& scene, RenderControl& control,
                                                              const Assets& assets = {},
                                                              SceneCacheEntry* claim = nullptr);

/// The same, but the meshes of `scene.objects` become the compiled scene's: they have no vertices and triangles
/// afterwards, whatever comes of it. Twice as much would lie in memory while the BVH is built. The rest of `scene`
/// stays as it is.
Result<std::shared_ptr<const CompiledScene>, Failure> compile_taking_meshes(Scene& scene, RenderControl& control,
                                                                            const Assets& assets = {},
                                                                            SceneCacheEntry* claim = nullptr);

/// What an earlier scene left for this one.
struct CacheHits {
  bool geometry = false;                             ///< shapes, their meshes' files and the BVH
  std::uint32_t textures = 0, decoded_textures = 0;  ///< those that were there, and the others
};
CacheHits cache_hits(const CompiledScene& scene);

/// Bytes held by the compiled scene, BVH included; also what it shares with others.
std::uint64_t memory_bytes(const CompiledScene& scene);

}  // namespace tracer
