#include "api/load_assets.h"

#include <utility>
#include <variant>

#include "api/load_meshes.h"

namespace api {
namespace {

constexpr std::size_t told_max = 1000;  // as of the other kinds of issues

/// Files of meshes are meshes by now, and may be most of what there is in memory.
void keep_pictures(const tracer::Scene& scene, tracer::Assets& assets) {
  std::vector<bool> is_picture(assets.bytes.size());
  for (const tracer::Texture& texture : scene.textures)
    if (const auto* picture = std::get_if<tracer::ImageTexture>(&texture.pattern))
      is_picture[picture->file.index] = true;
  for (std::size_t i = 0; i < assets.bytes.size(); ++i)
    if (!is_picture[i]) std::vector<std::uint8_t>().swap(assets.bytes[i]);
}

}  // namespace

std::vector<tracer::Issue> check_assets(const tracer::Scene& scene, const RefuseAsset& refuse) {
  std::vector<tracer::Issue> issues;
  std::size_t untold = 0;
  for (const tracer::Asset& asset : scene.assets) {
    const std::string refusal = refuse(asset.name);
    if (refusal.empty()) continue;
    if (issues.size() < told_max) {
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
  tracer::Assets assets;
  std::vector<tracer::Issue> issues = check_assets(scene, [&](const std::string& name) {
    AssetBytes bytes = read(name);
    if (!bytes) return bytes.error();
    assets.bytes.push_back(std::move(*bytes));
    return std::string();
  });
  if (issues.empty()) issues = load_meshes(scene, assets, limits);
  if (!issues.empty()) return issues;
  keep_pictures(scene, assets);
  return assets;
}

}  // namespace api
