#pragma once
/// Reads the files that a scene may name: below the asset directory, or among the uploads.

#include <optional>
#include <string>

#include "server/worker/protocol/asset_directory.h"
#include "server/worker/protocol/worker_options.h"

namespace worker {

/// Thread-safe.
class SceneFiles {
 public:
  /// Throws std::system_error if a directory that is set cannot be opened.
  explicit SceneFiles(const FileSettings& settings);

  /// The content of the file that a document calls `name`, or the reason why it is not available. Throws as
  /// AssetDirectory::read.
  [[nodiscard]] api::AssetBytes read(const std::string& name) const;

  /// An identifier of that content without reading it: equal only if the bytes are. That of an upload is its name, that
  /// of another file AssetDirectory::stamp. Empty if unknown. Throws as AssetDirectory::read.
  [[nodiscard]] std::string content_name(const std::string& name) const;

 private:
  std::optional<AssetDirectory> directory_, uploads_;
};

}  // namespace worker
