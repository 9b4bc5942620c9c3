#include "api/load_assets.h"

#include <utility>

#include "api/load_meshes.h"

namespace api {
namespace {

constexpr std::size_t told_max = 1000;  // as of the other kinds of issues

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
  return assets;
}

}  // namespace api
