#pragma once
/// Decodes the image files of a scene's textures to mip maps.

#include <memory>
#include <vector>

#include "tracer/compile.h"
#include "tracer/src/compile/scene_cache_entry.h"
#include "tracer/src/textures/image_map.h"

namespace tracer {

using TextureImages = std::vector<std::shared_ptr<const ImageMap>>;

/// One element per texture, null for patterns; textures of the same file in the same color space share one image.
/// Uses the cache unless `cache_entry` is null, and counts in `cache_hits`. Fails with `bad_asset`, and between two
/// files with `cancelled`.
Result<TextureImages, Failure> texture_images(const std::vector<Texture>& textures, const std::vector<Asset>& assets,
                                              const Assets& content, const RenderControl& control,
                                              SceneCacheEntry* cache_entry, CacheHits& cache_hits);

}  // namespace tracer
