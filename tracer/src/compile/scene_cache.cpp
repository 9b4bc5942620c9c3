#include "tracer/scene_cache.h"

#include <utility>

#include "tracer/src/compile/geometry_hash.h"
#include "tracer/src/compile/scene_cache_entry.h"

namespace tracer {

SceneCache::SceneCache(std::uint64_t bytes_max) : shelf_(std::make_shared<LruCache>(bytes_max)) {}
SceneCache::~SceneCache() = default;

void SceneCache::clear() { shelf_->clear(); }

SceneCache::Bytes SceneCache::memory_bytes() const {
  return {shelf_->memory_bytes(LruCache::Kind::geometry), shelf_->memory_bytes(LruCache::Kind::image)};
}

Result<std::shared_ptr<SceneCacheEntry>, Failure> SceneCache::claim(Scene& scene, std::vector<std::string> contents,
                                                                    const RenderControl& control) {
  if (shelf_->bytes_max() == 0)
    return std::make_shared<SceneCacheEntry>(shelf_, std::vector<std::string>(), std::nullopt);
  const auto name = geometry_hash(scene, contents);
  if (!name) return std::make_shared<SceneCacheEntry>(shelf_, std::move(contents), std::nullopt);
  auto turn = shelf_->turn({LruCache::Kind::geometry, *name}, control);
  if (!turn) return turn.error();
  auto claim = std::make_shared<SceneCacheEntry>(shelf_, std::move(contents), std::move(*turn));
  if (const KeptGeometry* kept = claim->geometry()) stand_in_for_files(scene, kept->accelerator->geometry());
  return claim;
}

const KeptGeometry* SceneCacheEntry::geometry() const {
  return geometry_ ? static_cast<const KeptGeometry*>(geometry_->found().get()) : nullptr;
}

void SceneCacheEntry::keep(const KeptGeometry& geometry) {
  if (!geometry_) return;
  const GeometrySet& set = geometry.accelerator->geometry();
  // The frame of nothing but planes follows the camera.
  const bool has_place = !set.spheres.empty() || !set.triangles.empty() || !set.quadrics.empty();
  if (has_place && tracer::memory_bytes(set) >= SceneCache::worthwhile_bytes)
    geometry_->keep(std::make_shared<const KeptGeometry>(geometry), geometry.accelerator->memory_bytes());
  geometry_.reset();
}

Result<std::optional<LruCache::Turn>, Failure> SceneCacheEntry::image(const ImageTexture& texture,
                                                                      const RenderControl& control) {
  const std::uint32_t file = texture.file.index;
  if (file >= contents_.size() || contents_[file].empty()) return std::optional<LruCache::Turn>();
  const auto& space = texture.color_space;
  const char read_as = !space ? 'd' : *space == ColorSpace::linear ? 'l' : 's';
  auto turn = shelf_->turn({LruCache::Kind::image, read_as + contents_[file]}, control);
  if (!turn) return turn.error();
  return std::optional<LruCache::Turn>(std::move(*turn));
}

void SceneCacheEntry::keep(LruCache::Turn turn, const std::shared_ptr<const ImageMap>& image) {
  const std::uint64_t bytes = image->memory_bytes();
  if (bytes >= SceneCache::worthwhile_bytes) turn.keep(image, bytes);
}

}  // namespace tracer
