#pragma once
/// Opens the files of scenes below one directory; nothing outside it is reachable, whatever the name.

#include <functional>
#include <optional>
#include <string>

#include "api/load_assets.h"
#include "server/support/descriptor.h"
#include "server/worker/protocol/protocol.h"
#include "tracer/result.h"

namespace worker {

using OpenedFile = tracer::Result<support::Descriptor, std::string>;

/// Names are relative to the directory (api::Files::below_a_directory), and the kernel enforces that (openat2 with
/// RESOLVE_BENEATH): "..", absolute names and symbolic links do not lead outside. Links that stay inside are followed.
/// Thread-safe.
class AssetDirectory {
 public:
  /// Throws std::system_error without the directory, or if the kernel has no openat2 (Linux 5.6).
  explicit AssetDirectory(const std::string& path);

  // Both throw std::system_error if this process has no free descriptors or memory.

  /// Empty if `name` is a regular file of at most api::asset_bytes_max bytes, else the end of a sentence with the
  /// reason. Opens nothing for reading.
  [[nodiscard]] std::string refusal(const std::string& name) const;

  /// Such a file, opened for reading. Pipes and devices do not block it.
  [[nodiscard]] OpenedFile open(const std::string& name) const;

  /// Changes with the content of the file: its identity, size and time of change. Empty if `refusal` is not, or if the
  /// change is less than two seconds ago, because file times are coarse. Opens nothing for reading.
  [[nodiscard]] std::string stamp(const std::string& name) const;

 private:
  support::Descriptor directory_;
};

/// Opens the upload with a sha256 for reading; an empty descriptor where there is none. May throw.
using OpenUpload = std::function<support::Descriptor(const std::string& sha256)>;

/// Opens the files that a scene may name: below the asset directory, or among the uploads. Thread-safe.
class SceneFiles {
 public:
  /// `open_upload`, where given, is used in place of the directory of uploads. Throws std::system_error if a directory
  /// that is set cannot be opened.
  explicit SceneFiles(const FileSettings& settings, OpenUpload open_upload = {});

  /// The file that a document calls `name`, opened for reading, or the reason why it is not available. Throws as
  /// AssetDirectory::open and `open_upload`.
  [[nodiscard]] OpenedFile open(const std::string& name) const;

  /// An identifier of its content without reading it: equal only if the bytes are. That of an upload is its name, that
  /// of another file AssetDirectory::stamp. Empty if unknown. Throws as AssetDirectory::open.
  [[nodiscard]] std::string content_name(const std::string& name) const;

 private:
  std::optional<AssetDirectory> directory_, uploads_;
  const OpenUpload open_upload_;
};

}  // namespace worker
