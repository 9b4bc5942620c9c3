#pragma once
/// What a scene has of a cache while it is compiled.

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

/// Shapes as rays meet them, and where they lie in the world.
struct KeptGeometry {
  std::shared_ptr<const Accelerator> accelerator;
  Bounds bounds;
};

/// For the thread that compiles the scene.
class SceneCacheEntry {
 public:
  /// `geometry`: nothing where the scene's is not to be kept.
  SceneCacheEntry(std::shared_ptr<LruCache> shelf, std::vector<std::string> contents,
                  std::optional<LruCache::Turn> geometry)
      : shelf_(std::move(shelf)), contents_(std::move(contents)), geometry_(std::move(geometry)) {}

  /// Of an earlier scene, or null.
  [[nodiscard]] const KeptGeometry* geometry() const;
  /// Precondition: there was none. Keeps it where that is worth while.
  void keep(const KeptGeometry& geometry);

  /// Nothing where the content of the file is not known. Fails with `cancelled`.
  Result<std::optional<LruCache::Turn>, Failure> image(const ImageTexture& texture, const RenderControl& control);
  /// Where that is worth while.
  static void keep(LruCache::Turn turn, const std::shared_ptr<const ImageMap>& image);

 private:
  std::shared_ptr<LruCache> shelf_;
  std::vector<std::string> contents_;
  std::optional<LruCache::Turn> geometry_;
};

}  // namespace tracer
