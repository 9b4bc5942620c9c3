#include "tracer/scene_cache.h"

#include <utility>

#include "tracer/src/compile/geometry_hash.h"
#include "tracer/src/compile/scene_cache_entry.h"

namespace tracer {

SceneCache::SceneCache(std::uint64_t bytes_max) : cache_(std::make_shared<LruCache>(bytes_max)) {}
SceneCache::~SceneCache() = default;

void SceneCache::clear() { cache_->clear(); }

SceneCache::Bytes SceneCache::memory_bytes() const {
  return {cache_->memory_bytes(LruCache::Kind::geometry), cache_->memory_bytes(LruCache::Kind::image)};
}

Result<std::shared_ptr<SceneCacheEntry>, Failure> SceneCache::acquire(Scene& scene, std::vector<std::string> contents,
                                                                      const RenderControl& control) {
  if (cache_->bytes_max() == 0)
    return std::make_shared<SceneCacheEntry>(cache_, std::vector<std::string>(), std::nullopt);
  const auto name = geometry_hash(scene, contents);
  if (!name) return std::make_shared<SceneCacheEntry>(cache_, std::move(contents), std::nullopt);
  auto ticket = cache_->acquire({LruCache::Kind::geometry, *name}, control);
  if (!ticket) return ticket.error();
  auto entry = std::make_shared<SceneCacheEntry>(cache_, std::move(contents), std::move(*ticket));
  if (const CachedGeometry* cached = entry->geometry()) replace_file_meshes(scene, cached->accelerator->geometry());
  return entry;
}

const CachedGeometry* SceneCacheEntry::geometry() const {
  return geometry_ ? static_cast<const CachedGeometry*>(geometry_->found().get()) : nullptr;
}

void SceneCacheEntry::store(const CachedGeometry& geometry) {
  if (!geometry_) return;
  const GeometrySet& set = geometry.accelerator->geometry();
  // The render space of a scene with planes only depends on the camera.
  const bool has_place = !set.spheres.empty() || !set.triangles.empty() || !set.quadrics.empty();
  if (has_place && tracer::memory_bytes(set) >= SceneCache::worthwhile_bytes)
    geometry_->store(std::make_shared<const CachedGeometry>(geometry), geometry.accelerator->memory_bytes());
  geometry_.reset();
}

Result<std::optional<LruCache::BuildTicket>, Failure> SceneCacheEntry::image(const ImageTexture& texture,
                                                                             const RenderControl& control) {
  const std::uint32_t file = texture.file.index;
  if (file >= contents_.size() || contents_[file].empty()) return std::optional<LruCache::BuildTicket>();
  const auto& space = texture.color_space;
  const char read_as = !space ? 'd' : *space == ColorSpace::linear ? 'l' : 's';
  auto ticket = cache_->acquire({LruCache::Kind::image, read_as + contents_[file]}, control);
  if (!ticket) return ticket.error();
  return std::optional<LruCache::BuildTicket>(std::move(*ticket));
}

void SceneCacheEntry::store(LruCache::BuildTicket ticket, const std::shared_ptr<const ImageMap>& image) {
  const std::uint64_t bytes = image->memory_bytes();
  if (bytes >= SceneCache::worthwhile_bytes) ticket.store(image, bytes);
}

}  // namespace tracer
