#include "tracer/scene_cache.h"

#include <utility>

#include "tracer/src/cache/geometry_name.h"
#include "tracer/src/cache/scene_claim.h"

namespace tracer {

SceneCache::SceneCache(std::uint64_t bytes_max) : shelf_(std::make_shared<Shelf>(bytes_max)) {}
SceneCache::~SceneCache() = default;

void SceneCache::clear() { shelf_->clear(); }

SceneCache::Bytes SceneCache::memory_bytes() const {
  return {shelf_->memory_bytes(Shelf::Kind::geometry), shelf_->memory_bytes(Shelf::Kind::picture)};
}

Result<std::shared_ptr<SceneClaim>, Failure> SceneCache::claim(Scene& scene, std::vector<std::string> contents,
                                                               const RenderControl& control) {
  if (shelf_->bytes_max() == 0) return std::make_shared<SceneClaim>(shelf_, std::vector<std::string>(), std::nullopt);
  const auto name = geometry_name(scene, contents);
  if (!name) return std::make_shared<SceneClaim>(shelf_, std::move(contents), std::nullopt);
  auto turn = shelf_->turn({Shelf::Kind::geometry, *name}, control);
  if (!turn) return turn.error();
  auto claim = std::make_shared<SceneClaim>(shelf_, std::move(contents), std::move(*turn));
  if (const KeptGeometry* kept = claim->geometry()) stand_in_for_files(scene, kept->accelerator->geometry());
  return claim;
}

const KeptGeometry* SceneClaim::geometry() const {
  return geometry_ ? static_cast<const KeptGeometry*>(geometry_->found().get()) : nullptr;
}

void SceneClaim::keep(const KeptGeometry& geometry) {
  if (!geometry_) return;
  const GeometrySet& set = geometry.accelerator->geometry();
  // The frame of nothing but planes follows the camera.
  const bool has_place = !set.spheres.empty() || !set.triangles.empty() || !set.quadrics.empty();
  if (has_place && tracer::memory_bytes(set) >= SceneCache::worthwhile_bytes)
    geometry_->keep(std::make_shared<const KeptGeometry>(geometry), geometry.accelerator->memory_bytes());
  geometry_.reset();
}

Result<std::optional<Shelf::Turn>, Failure> SceneClaim::picture(const ImageTexture& texture,
                                                                const RenderControl& control) {
  const std::uint32_t file = texture.file.index;
  if (file >= contents_.size() || contents_[file].empty()) return std::optional<Shelf::Turn>();
  const auto& space = texture.color_space;
  const char read_as = !space ? 'd' : *space == ColorSpace::linear ? 'l' : 's';
  auto turn = shelf_->turn({Shelf::Kind::picture, read_as + contents_[file]}, control);
  if (!turn) return turn.error();
  return std::optional<Shelf::Turn>(std::move(*turn));
}

void SceneClaim::keep(Shelf::Turn turn, const std::shared_ptr<const ImageMap>& picture) {
  const std::uint64_t bytes = picture->memory_bytes();
  if (bytes >= SceneCache::worthwhile_bytes) turn.keep(picture, bytes);
}

}  // namespace tracer
