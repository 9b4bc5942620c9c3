#pragma once
/// A scene's document with the files that it names.

#include <string>
#include <string_view>

#include "api/document.h"
#include "tracer/assets.h"
#include "tracer/cli/files.h"

namespace cli {

/// Ready to be compiled: meshes of files have been read into the scene.
struct Loaded {
  api::Document document;
  tracer::Assets assets;
};

/// `text` is the document; its files' names are relative to the directory of `scene_path` ("-": the working directory).
/// Those named by their sha256 lie in `uploads_directory` under these names, or as a daemon's data/uploads keeps them
/// (empty: there is none). Ordinary files only, each at most api::asset_bytes_max. An asset that cannot be read is an
/// issue "bad_asset" where the document names it first.
tracer::Result<Loaded, api::Refusal> load(std::string_view text, const std::string& scene_path,
                                          const std::string& uploads_directory);

}  // namespace cli
