#pragma once
/// Access of one compilation to a SceneCache.

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tracer/scene.h"
#include "tracer/src/accel/accelerator.h"
#include "tracer/src/compile/lru_cache.h"
#include "tracer/src/scene/render_space.h"
#include "tracer/src/textures/image_map.h"

namespace tracer {

/// Accelerator and world-space bounds of cached geometry.
struct CachedGeometry {
  std::shared_ptr<const Accelerator> accelerator;
  Bounds bounds;
};

/// Used only by the thread that compiles the scene.
class SceneCacheEntry {
 public:
  /// `geometry`: empty if the scene's geometry is not cached.
  SceneCacheEntry(std::shared_ptr<LruCache> cache, std::vector<std::string> contents,
                  std::optional<LruCache::BuildTicket> geometry)
      : cache_(std::move(cache)), contents_(std::move(contents)), geometry_(std::move(geometry)) {}

  /// Geometry of an earlier scene, or null.
  [[nodiscard]] const CachedGeometry* geometry() const;
  /// Stores geometry of at least SceneCache::worthwhile_bytes. Precondition: geometry() is null.
  void store(const CachedGeometry& geometry);

  /// Empty if the content of the file is unknown. Fails with `cancelled`.
  Result<std::optional<LruCache::BuildTicket>, Failure> image(const ImageTexture& texture,
                                                              const RenderControl& control);
  /// Stores images of at least SceneCache::worthwhile_bytes.
  static void store(LruCache::BuildTicket ticket, const std::shared_ptr<const ImageMap>& image);

 private:
  std::shared_ptr<LruCache> cache_;
  std::vector<std::string> contents_;
  std::optional<LruCache::BuildTicket> geometry_;
};

}  // namespace tracer
