#include "server/worker/protocol/scene_files.h"

#include "api/document.h"
#include "server/queue/asset_store.h"

namespace worker {

SceneFiles::SceneFiles(const FileSettings& settings) {
  if (!settings.directory.empty()) directory_.emplace(settings.directory);
  if (!settings.uploads.empty()) uploads_.emplace(settings.uploads);
}

api::AssetBytes SceneFiles::read(const std::string& name) const {
  const bool is_upload = name.starts_with(api::upload_prefix);
  const auto& directory = is_upload ? uploads_ : directory_;
  if (!directory) return std::string("this worker has no directory for it");  // the reader rejects such names
  return directory->read(is_upload ? queue::asset_path(name.substr(api::upload_prefix.size())) : name);
}

std::string SceneFiles::content_name(const std::string& name) const {
  if (name.starts_with(api::upload_prefix)) return uploads_ ? name : std::string();
  return directory_ ? directory_->stamp(name) : std::string();
}

}  // namespace worker
