#include "tracer/cli/asset_directory_files.h"

#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "api/load_assets.h"

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
  if (size <= api::asset_bytes_max) return "";
  return "the limit asset_bytes_max is " + std::to_string(api::asset_bytes_max) + ", it has " + std::to_string(size);
}

api::AssetBytes read(const fs::path& path) {
  if (std::string refused = refusal(path); !refused.empty()) return refused;
  auto bytes = read_all_bytes(path.string(), api::asset_bytes_max);
  if (!bytes) return bytes.error().sentence;
  return std::move(*bytes);
}

api::AssetBytes read_upload(const std::string& directory, const std::string& name) {
  if (directory.empty()) return std::string("is the name of an upload; --assets DIRECTORY says where those are");
  const std::string hash = name.substr(api::upload_prefix.size());
  const fs::path plain = fs::path(directory) / hash;
  return read(fs::exists(plain) ? plain : fs::path(directory) / hash.substr(0, 2) / hash);
}

}  // namespace

tracer::Result<Loaded, api::Refusal> load(std::string_view text, const std::string& scene_path,
                                          const std::string& uploads_directory) {
  api::Limits limits;
  limits.files = api::Files::anywhere;
  limits.uploads = true;
  auto document = api::parse_scene(text, limits);
  if (!document) return std::move(document.error());
  const fs::path directory = scene_path == "-" ? fs::path() : fs::path(scene_path).parent_path();
  const auto read_asset = [&](const std::string& name) {
    return name.starts_with(api::upload_prefix) ? read_upload(uploads_directory, name) : read(directory / name);
  };
  auto assets = api::load_assets(document->scene, read_asset, limits.scene);
  if (assets) return Loaded{std::move(*document), std::move(*assets)};
  api::Refusal refusal;
  refusal.detail = "the scene cannot be rendered with its files";
  refusal.issues = std::move(assets.error());
  return refusal;
}

}  // namespace cli
