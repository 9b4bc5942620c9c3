#pragma once
/// Reads a scene document and the files that it names.

#include <optional>
#include <string>

#include "api/document.h"
#include "tracer/assets.h"
#include "tracer/cli/files.h"
#include "tracer/cli/options.h"

namespace cli {

/// Ready for tracer::compile: meshes from files are part of the scene.
struct LoadedScene {
  api::Document document;
  tracer::Assets assets;
};

/// Text of the document, at most one byte more than the limit of documents.
tracer::Result<std::string, FileError> read_document(const SceneSource& source);

/// `text` is the document. File names in it are relative to the directory of `source.path` (for "-": the working
/// directory). A file named by its SHA-256 has that name in `source.assets_directory`, or the path that the daemon
/// gives it in data/uploads. Regular files only, each at most api::asset_bytes_max. An asset that cannot be read is an
/// issue "bad_asset" at its first use in the document.
tracer::Result<LoadedScene, api::Refusal> load_scene(const std::string& text, const SceneSource& source);

}  // namespace cli
