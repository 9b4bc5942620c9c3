#include "server/worker/scene_files.h"

#include "api/document.h"
#include "server/jobs/asset_store.h"

namespace worker {

SceneFiles::SceneFiles(const FileSettings& settings) {
  if (!settings.folder.empty()) folder_.emplace(settings.folder);
  if (!settings.uploads.empty()) uploads_.emplace(settings.uploads);
}

api::AssetBytes SceneFiles::read(const std::string& name) const {
  const bool is_upload = name.starts_with(api::upload_prefix);
  const auto& folder = is_upload ? uploads_ : folder_;
  if (!folder) return std::string("this worker has no folder for it");  // the reader let no such name pass
  return folder->read(is_upload ? jobs::asset_path(name.substr(api::upload_prefix.size())) : name);
}

std::string SceneFiles::content_name(const std::string& name) const {
  if (name.starts_with(api::upload_prefix)) return uploads_ ? name : std::string();
  return folder_ ? folder_->stamp(name) : std::string();
}

}  // namespace worker
