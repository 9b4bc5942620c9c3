/// Names of files that come with a document.

#include <string>
#include <string_view>
#include <vector>

#include "api/src/reader/sections.h"
#include "api/src/reader/values.h"

namespace api {
namespace {

constexpr std::size_t asset_name_bytes = 4096;  // PATH_MAX

bool is_asset_name(Reading& reading, const Cursor& at, std::string_view name) {
  if (!reading.limits.files) {
    tell(reading, at, "unsupported", "files are for the command line: this service takes no assets yet");
  } else if (name.starts_with("sha256:")) {
    tell(reading, at, "unsupported", "assets by hash are for a service that takes uploads; name a file instead");
  } else if (name.empty() || has_control_characters(name)) {
    tell(reading, at, "malformed", "must be a path relative to the scene file, got " + quoted(name));
  } else if (name.size() > asset_name_bytes) {
    tell(reading, at, "limit_exceeded",
         "the limit asset_name_bytes is " + std::to_string(asset_name_bytes) + ", got " + std::to_string(name.size()));
  } else {
    return true;
  }
  return false;
}

}  // namespace

bool read_asset(Reading& reading, const Cursor& at, tracer::AssetId& asset) {
  if (at.node->kind != json::Kind::string) {
    tell_wrong_type(reading, at, "a path relative to the scene file");
    return false;
  }
  const std::string_view name = at.node->string();
  if (!is_asset_name(reading, at, name)) return false;
  std::vector<tracer::Asset>& assets = reading.scene().assets;
  const auto [place, is_new] =
      reading.assets.ids.emplace(name, tracer::AssetId{static_cast<std::uint32_t>(assets.size())});
  if (is_new) assets.push_back({std::string(name), pointer(at)});
  asset = place->second;
  return true;
}

}  // namespace api
