#pragma once
/// Every file that a scene may name, wherever it lies: below the asset folder, or among the uploads.

#include <optional>
#include <string>

#include "server/worker/asset_folder.h"
#include "server/worker/options.h"

namespace worker {

/// Thread-safe.
class SceneFiles {
 public:
  /// Throws std::system_error as AssetFolder does, of a folder that is set.
  explicit SceneFiles(const FileSettings& settings);

  /// The content of what a document calls `name`, or why it cannot be had. Throws as AssetFolder::read.
  [[nodiscard]] api::AssetBytes read(const std::string& name) const;

  /// A name for that content, before it is read: equal only where the bytes are. Of an upload it is its own name, of
  /// another file what AssetFolder::stamp says. Empty where it is not known. Throws as AssetFolder::read.
  [[nodiscard]] std::string content_name(const std::string& name) const;

 private:
  std::optional<AssetFolder> folder_, uploads_;
};

}  // namespace worker
