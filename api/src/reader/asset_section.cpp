/// Names of the files that a document uses.

#include <string>
#include <string_view>
#include <vector>

#include "api/asset_requests.h"
#include "api/src/reader/field_values.h"
#include "api/src/reader/issue_text.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

constexpr std::size_t asset_name_bytes = 4096;  // PATH_MAX

/// True if each part between slashes is the plain name of a file or directory.
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
  if (!is_asset_hash(name.substr(upload_prefix.size())))
    return add_issue(reading, at, "malformed", "must be sha256: and 64 lower-case hex digits, got " + quoted(name));
  return reading.limits.uploads ||
         add_issue(reading, at, "unsupported",
                   "files named by hash are available only from a service that accepts uploads; name a file instead");
}

bool is_asset_name(Reading& reading, const Cursor& at, std::string_view name) {
  if (name.starts_with(upload_prefix)) return is_upload_name(reading, at, name);
  if (reading.limits.files == Files::none)
    return add_issue(reading, at, "unsupported",
                     "this service has no directory of files: it was started without the option --assets DIRECTORY. "
                     "Upload the file and name it by its hash");
  if (name.empty() || has_control_characters(name))
    return add_issue(reading, at, "malformed", "must be the relative path of a file, got " + quoted(name));
  if (name.size() > asset_name_bytes)
    return add_limit_exceeded(reading, at, "asset_name_bytes", asset_name_bytes, name.size());
  if (reading.limits.files == Files::below_a_directory && !stays_below_directory(name))
    return add_issue(reading, at, "malformed",
                     "must be a path below the asset directory, of plain names between slashes (no \"..\", \".\" or "
                     "backslash), got " +
                         quoted(name));
  return true;
}

}  // namespace

bool read(Reading& reading, const Cursor& at, tracer::AssetId& asset) {
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "the relative path of a file");
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
