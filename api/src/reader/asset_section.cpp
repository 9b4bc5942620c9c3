/// Names of files that come with a document.

#include <string>
#include <string_view>
#include <vector>

#include "api/asset_requests.h"
#include "api/src/reader/field_values.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

constexpr std::size_t asset_name_bytes = 4096;  // PATH_MAX

/// Whether each name between slashes is one of a file or directory in the one before.
bool stays_below_directory(std::string_view path) {
  if (path.find('\\') != std::string_view::npos) return false;
  while (true) {
    const std::size_t slash = path.find('/');
    const std::string_view name = path.substr(0, slash);
    if (name.empty() || name == "." || name == "..") return false;
    if (slash == std::string_view::npos) return true;
    path.remove_prefix(slash + 1);
  }
}

bool is_upload_name(Reading& reading, const Cursor& at, std::string_view name) {
  const std::string_view hash = name.substr(upload_prefix.size());
  if (!is_asset_hash(hash)) {
    add_issue(reading, at, "malformed", "must be sha256: and 64 lower-case hex digits, got " + quoted(name));
  } else if (!reading.limits.uploads) {
    add_issue(reading, at, "unsupported", "assets by hash are for a service that takes uploads; name a file instead");
  } else {
    return true;
  }
  return false;
}

bool is_asset_name(Reading& reading, const Cursor& at, std::string_view name) {
  if (name.starts_with(upload_prefix)) return is_upload_name(reading, at, name);
  if (reading.limits.files == Files::none) {
    add_issue(
        reading, at, "unsupported",
        "this service has no directory of files: it was started without the option --assets DIRECTORY. Upload the "
        "file and "
        "name it by its hash");
  } else if (name.empty() || has_control_characters(name)) {
    add_issue(reading, at, "malformed", "must be the relative path of a file, got " + quoted(name));
  } else if (name.size() > asset_name_bytes) {
    add_issue(
        reading, at, "limit_exceeded",
        "the limit asset_name_bytes is " + std::to_string(asset_name_bytes) + ", got " + std::to_string(name.size()));
  } else if (reading.limits.files == Files::below_a_directory && !stays_below_directory(name)) {
    add_issue(
        reading, at, "malformed",
        "must be a path below the asset directory, of plain names between slashes (no \"..\", \".\" or backslash), "
        "got " +
            quoted(name));
  } else {
    return true;
  }
  return false;
}

}  // namespace

bool read_asset(Reading& reading, const Cursor& at, tracer::AssetId& asset) {
  if (at.node->kind != json::Kind::string) {
    add_wrong_type(reading, at, "the relative path of a file");
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
