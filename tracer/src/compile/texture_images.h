#pragma once
/// From a scene's image files to the pyramids that textures are looked up in.

#include <memory>
#include <vector>

#include "tracer/compile.h"
#include "tracer/src/compile/scene_cache_entry.h"
#include "tracer/src/textures/image_map.h"

namespace tracer {

using TextureImages = std::vector<std::shared_ptr<const ImageMap>>;

/// One for each texture, null where it is no image; textures of the same file in the same colour space
/// share one. Those that an earlier scene left are taken where `claim` is not null; `reuse` counts them and the others.
/// Fails with `bad_asset`, and between two files with `cancelled`.
Result<TextureImages, Failure> texture_images(const std::vector<Texture>& textures, const std::vector<Asset>& assets,
                                              const Assets& content, const RenderControl& control,
                                              SceneCacheEntry* claim, CacheHits& cache_hits);

}  // namespace tracer
