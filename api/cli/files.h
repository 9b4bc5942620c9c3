#pragma once
/// Reads scenes with their assets and other input files, and writes output files atomically. Errors of the environment
/// are std::runtime_error: "cannot write /images/a.png: No space left on device".

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>

#include "api/cli/options.h"
#include "api/render_document.h"
#include "tracer/result.h"

namespace cli {

/// Content of `path` ("-": standard input), but at most `limit` + 1 bytes, so that a larger file can be rejected.
std::string read_text(const std::string& path, std::size_t limit);

/// Writes a file atomically, replacing any existing file.
void write_file(const std::string& path, std::span<const std::uint8_t> bytes);

/// An unlinked file in the directory of its path until `publish`. It leaves nothing behind when it is destroyed before
/// or the process is killed. Exceptions, after SIGKILL or power loss only: between linking and renaming when an old
/// file is replaced, and on file systems without O_TMPFILE, a temporary file PATH.whittle-XXXXXX may remain.
class PendingFile {
 public:
  explicit PendingFile(std::string path);
  PendingFile(PendingFile&& other) noexcept;
  ~PendingFile();

  /// Writes and synchronizes to disk, so that a full disk fails here. After a failure the old file is unchanged.
  void write(std::span<const std::uint8_t> bytes);
  /// Gives the file its path atomically, replacing any existing file.
  void publish();

 private:
  std::string path_;
  int descriptor_ = -1;
  std::string temporary_;  ///< path while it is not published; empty: unlinked
};

/// Text of the document, at most one byte more than the limit of documents. For a model (a file that ends in .glb,
/// .gltf, .obj, .ply or .stl) that of a document which stands for it, in the directory `directory`; empty: that of the
/// model.
std::string read_document(const SceneSource& source, const std::string& directory = {});

/// No limits but those of documents.
api::Limits reading_limits();
/// Reads files that documents name, as load_scene() does.
api::ReadAsset asset_reader(const SceneSource& source);

/// Parses `text` and loads its files. File names in it are relative to the directory of `source.path` (for "-": the
/// working directory). A file named by its SHA-256 has that name in `source.assets_directory`, or the path that the
/// daemon gives it in data/uploads. Regular files only, each at most api::asset_bytes_max. An asset that cannot be read
/// is an issue "bad_asset" at its first use in the document.
tracer::Result<std::monostate, api::Refusal> load_scene(api::DocumentRender& render, const std::string& text,
                                                        const SceneSource& source);

}  // namespace cli
