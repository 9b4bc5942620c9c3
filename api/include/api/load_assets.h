#pragma once
/// The step between reading a document and compiling it: the files that it names are read, by whoever knows where they
/// are, and those of meshes become meshes.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tracer/assets.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"
#include "tracer/validate.h"

namespace api {

/// Of one file, 256 MB: what the largest image that is taken needs uncompressed. For readers to keep to.
inline constexpr std::size_t asset_bytes_max = 256'000'000;

/// Asks for each of `scene.assets`, once and in order, why it cannot be had: the end of a sentence, "no such file", or
/// empty where it can. Gives a "bad_asset" where the document first names each that cannot; the sentence begins with
/// the file's name. Of 1000 at most, then one "too_many_issues" with the count of the rest.
using RefuseAsset = std::function<std::string(const std::string& name)>;
std::vector<tracer::Issue> check_assets(const tracer::Scene& scene, const RefuseAsset& refuse);

/// The content of a file, or the end of a sentence that says why it cannot be had: "no such file".
using AssetBytes = tracer::Result<std::vector<std::uint8_t>, std::string>;
using ReadAsset = std::function<AssetBytes(const std::string& name)>;

/// Asks `read` for each of `scene.assets` that a texture or a mesh still names, then does what load_meshes.h says with
/// `limits`. What comes back is for tracer::compile: images alone, for files of meshes are meshes by then. Otherwise
/// everything that is wrong: what check_assets says of files that cannot be had, or else what load_meshes says; the
/// scene is then good for nothing. Precondition: `validate` found nothing in `scene`. Throws only what `read` throws.
tracer::Result<tracer::Assets, std::vector<tracer::Issue>> load_assets(tracer::Scene& scene, const ReadAsset& read,
                                                                       const tracer::Limits& limits);

}  // namespace api
