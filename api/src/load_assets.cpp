#include "api/load_assets.h"

#include <utility>
#include <variant>

#include "api/load_meshes.h"

namespace api {
namespace {

constexpr std::size_t issues_max = 1000;  // as of the other kinds of issues

using PerAsset = std::vector<bool>;

PerAsset images_of(const tracer::Scene& scene) {
  PerAsset images(scene.assets.size());
  for (const tracer::Texture& texture : scene.textures)
    if (const auto* image = std::get_if<tracer::ImageTexture>(&texture.pattern)) images[image->file.index] = true;
  return images;
}

void add_mesh_files(const std::vector<tracer::Object>& objects, PerAsset& named) {
  for (const tracer::Object& object : objects)
    if (const auto* mesh = std::get_if<tracer::Mesh>(&object.shape); mesh != nullptr && mesh->file)
      named[mesh->file->index] = true;
}

/// Files of meshes are meshes by now, and may be most of what there is in memory.
void keep_images(const PerAsset& images, tracer::Assets& assets) {
  for (std::size_t i = 0; i < assets.bytes.size(); ++i)
    if (!images[i]) std::vector<std::uint8_t>().swap(assets.bytes[i]);
}

}  // namespace

std::vector<tracer::Issue> check_assets(const tracer::Scene& scene, const RefuseAsset& refuse) {
  std::vector<tracer::Issue> issues;
  std::size_t untold = 0;
  for (const tracer::Asset& asset : scene.assets) {
    const std::string refusal = refuse(asset.name);
    if (refusal.empty()) continue;
    if (issues.size() < issues_max) {
      issues.push_back({asset.path, "bad_asset", asset.name + ": " + refusal});
    } else {
      ++untold;
    }
  }
  if (untold > 0) issues.push_back({"", "too_many_issues", "and " + std::to_string(untold) + " more"});
  return issues;
}

tracer::Result<tracer::Assets, std::vector<tracer::Issue>> load_assets(tracer::Scene& scene, const ReadAsset& read,
                                                                       const tracer::Limits& limits) {
  const PerAsset images = images_of(scene);
  PerAsset named = images;
  add_mesh_files(scene.objects, named);
  for (const tracer::Prototype& prototype : scene.prototypes) add_mesh_files(prototype.objects, named);
  tracer::Assets assets;
  std::vector<tracer::Issue> issues = check_assets(scene, [&](const std::string& name) {
    if (!named[assets.bytes.size()]) {
      assets.bytes.emplace_back();
      return std::string();
    }
    AssetBytes bytes = read(name);
    if (!bytes) return bytes.error();
    assets.bytes.push_back(std::move(*bytes));
    return std::string();
  });
  if (issues.empty()) issues = load_meshes(scene, assets, limits);
  if (!issues.empty()) return issues;
  keep_images(images, assets);
  return assets;
}

}  // namespace api
