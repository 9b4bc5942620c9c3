#include "tracer/cli/assets.h"

#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "api/load_meshes.h"

namespace cli {
namespace {

namespace fs = std::filesystem;

/// Why the file is not read; empty when it can be tried. Pipes and devices could keep us waiting for ever.
std::string refusal(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (error && error != std::errc::no_such_file_or_directory) return error.message();
  if (!fs::exists(status)) return "no such file at " + path.string();
  if (!fs::is_regular_file(status)) return "is no ordinary file";
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return error.message();
  if (size <= asset_bytes_max) return "";
  return "the limit asset_bytes_max is " + std::to_string(asset_bytes_max) + ", it has " + std::to_string(size);
}

/// One issue for each asset that cannot be read.
std::vector<tracer::Issue> read_assets(const tracer::Scene& scene, const fs::path& folder, tracer::Assets& assets) {
  std::vector<tracer::Issue> issues;
  for (const tracer::Asset& asset : scene.assets) {
    const fs::path path = folder / asset.name;
    std::vector<std::uint8_t>& content = assets.bytes.emplace_back();
    std::string refused = refusal(path);
    if (refused.empty()) {
      const auto bytes = read_all(path.string(), asset_bytes_max);
      if (bytes) {
        content.assign(bytes->begin(), bytes->end());
      } else {
        refused = bytes.error().sentence;
      }
    }
    if (!refused.empty()) issues.push_back({asset.path, "bad_asset", asset.name + ": " + refused});
  }
  return issues;
}

api::Refusal refusal(std::vector<tracer::Issue> issues) {
  api::Refusal refusal;
  refusal.detail = "the scene cannot be rendered with its files";
  refusal.issues = std::move(issues);
  return refusal;
}

}  // namespace

tracer::Result<Loaded, api::Refusal> load(std::string_view text, const std::string& scene_path) {
  api::Limits limits;
  limits.files = true;
  auto document = api::parse_scene(text, limits);
  if (!document) return std::move(document.error());
  Loaded loaded{std::move(*document), {}};
  const fs::path folder = scene_path == "-" ? fs::path() : fs::path(scene_path).parent_path();
  tracer::Scene& scene = loaded.document.scene;
  if (auto issues = read_assets(scene, folder, loaded.assets); !issues.empty()) return refusal(std::move(issues));
  if (auto issues = api::load_meshes(scene, loaded.assets, limits.scene); !issues.empty())
    return refusal(std::move(issues));
  return loaded;
}

}  // namespace cli
