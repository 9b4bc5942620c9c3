#include "tracer/cli/load_scene.h"

#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "api/load_assets.h"

namespace cli {
namespace {

namespace fs = std::filesystem;

/// Reason not to open the file, else empty. Pipes and devices could block forever.
std::string error_before_open(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (error && error != std::errc::no_such_file_or_directory) return error.message();
  if (!fs::exists(status)) return "no such file at " + path.string();
  if (!fs::is_regular_file(status)) return "is not a regular file";
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return error.message();
  if (size <= api::asset_bytes_max) return "";
  return "the limit asset_bytes_max is " + std::to_string(api::asset_bytes_max) + ", it has " + std::to_string(size);
}

api::AssetBytes read(const fs::path& path) {
  if (std::string error = error_before_open(path); !error.empty()) return error;
  auto bytes = read_bytes(path.string(), api::asset_bytes_max);
  if (!bytes) return bytes.error().message;
  return std::move(*bytes);
}

api::AssetBytes read_upload(const std::string& directory, const std::string& name) {
  if (directory.empty()) return std::string("names an uploaded file: --assets DIRECTORY is required");
  const std::string hash = name.substr(api::upload_prefix.size());
  const fs::path plain = fs::path(directory) / hash;
  return read(fs::exists(plain) ? plain : fs::path(directory) / hash.substr(0, 2) / hash);
}

}  // namespace

tracer::Result<std::string, FileError> read_document(const SceneSource& source) {
  return read_text(source.path, api::DocumentLimits{}.bytes);
}

tracer::Result<LoadedScene, api::Refusal> load_scene(const std::string& text, const SceneSource& source) {
  api::Limits limits;
  limits.files = api::Files::anywhere;
  limits.uploads = true;
  auto document = api::parse_scene(text, limits);
  if (!document) return std::move(document.error());
  const fs::path directory = source.path == "-" ? fs::path() : fs::path(source.path).parent_path();
  const auto read_asset = [&](const std::string& name) {
    return name.starts_with(api::upload_prefix) ? read_upload(source.assets_directory, name) : read(directory / name);
  };
  auto assets = api::load_assets(document->scene, read_asset, limits.scene);
  if (assets) return LoadedScene{std::move(*document), std::move(*assets)};
  api::Refusal refusal;
  refusal.detail = "the scene cannot be rendered with its files";
  refusal.issues = std::move(assets.error());
  return refusal;
}

}  // namespace cli
