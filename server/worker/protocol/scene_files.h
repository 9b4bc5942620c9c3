#pragma once
/// Every file that a scene may name, wherever it lies: below the asset directory, or among the uploads.

#include <optional>
#include <string>

#include "server/worker/protocol/asset_directory.h"
#include "server/worker/protocol/worker_options.h"

namespace worker {

/// Thread-safe.
class SceneFiles {
 public:
  /// Throws std::system_error as AssetDirectory does, of a directory that is set.
  explicit SceneFiles(const FileSettings& settings);

  /// The content of what a document calls `name`, or why it cannot be had. Throws as AssetDirectory::read.
  [[nodiscard]] api::AssetBytes read(const std::string& name) const;

  /// A name for that content, before it is read: equal only where the bytes are. Of an upload it is its own name, of
  /// another file what AssetDirectory::stamp says. Empty where it is not known. Throws as AssetDirectory::read.
  [[nodiscard]] std::string content_name(const std::string& name) const;

 private:
  std::optional<AssetDirectory> directory_, uploads_;
};

}  // namespace worker
