#include "tracer/cli/assets.h"

#include <filesystem>
#include <system_error>
#include <utility>

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

}  // namespace

tracer::Result<tracer::Assets, AssetFailure> read_assets(const tracer::Scene& scene, const std::string& scene_path) {
  const fs::path folder = scene_path == "-" ? fs::path() : fs::path(scene_path).parent_path();
  tracer::Assets assets;
  for (const tracer::Asset& asset : scene.assets) {
    const fs::path path = folder / asset.name;
    if (const std::string refused = refusal(path); !refused.empty()) {
      return AssetFailure{asset.path, asset.name + ": " + refused};
    }
    const auto bytes = read_all(path.string(), asset_bytes_max);
    if (!bytes) return AssetFailure{asset.path, asset.name + ": " + bytes.error().sentence};
    assets.bytes.emplace_back(bytes->begin(), bytes->end());
  }
  return assets;
}

}  // namespace cli
