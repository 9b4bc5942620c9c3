#pragma once
/// Reads the files that a scene names.

#include <string>

#include "tracer/assets.h"
#include "tracer/cli/files.h"
#include "tracer/scene.h"

namespace cli {

/// An asset that cannot be read, and where the scene names it.
struct AssetFailure {
  std::string pointer;
  std::string detail;  ///< begins with the file's name
};

/// Names are relative to the folder of `scene_path` ("-": the working folder). Ordinary files only, each at most
/// `asset_bytes_max`.
tracer::Result<tracer::Assets, AssetFailure> read_assets(const tracer::Scene& scene, const std::string& scene_path);

/// 256 MB: what the largest picture that is taken needs uncompressed.
inline constexpr std::size_t asset_bytes_max = 256'000'000;

}  // namespace cli
