#pragma once
/// The step between reading and compiling a document: the files that it names are read, and meshes of files are
/// replaced by their triangles.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"
#include "tracer/validate.h"

namespace api {

/// Maximum of one file, to be enforced by the caller: the largest accepted image needs 256 MB uncompressed.
inline constexpr std::size_t asset_bytes_max = 256'000'000;

/// Returns the reason why a file is unavailable, as the end of a sentence ("no such file"), or an empty string.
using RefuseAsset = std::function<std::string(const std::string& name)>;
/// Calls `refuse` for each of `scene.assets`, once and in order. Each unavailable file is a "bad_asset" at its first
/// use in the document, with a sentence that begins with its name: at most 1000, then one "too_many_issues" with the
/// count of the others.
std::vector<tracer::Issue> check_assets(const tracer::Scene& scene, const RefuseAsset& refuse);

/// The content of a file, or the reason as for RefuseAsset.
using AssetBytes = tracer::Result<std::vector<std::uint8_t>, std::string>;
using ReadAsset = std::function<AssetBytes(const std::string& name)>;

/// Calls `read` for each of `scene.assets` that a texture or a mesh uses, then load_meshes(). The result is for
/// tracer::compile and has images only. Otherwise all issues: those of check_assets, else those of load_meshes; the
/// scene must then be discarded. Precondition: `validate` accepts `scene`. Throws only exceptions of `read`.
tracer::Result<tracer::Assets, std::vector<tracer::Issue>> load_assets(tracer::Scene& scene, const ReadAsset& read,
                                                                       const tracer::Limits& limits);

/// Reads the file of each mesh of `scene` (objects and prototypes) that has one: OBJ, PLY, STL, glTF or GLB, recognised
/// by content (tracer/mesh_file.h, api/src/gltf/gltf.h). Each file is read once for all smooth meshes and once for the
/// others. A mesh with materials for parts of its file becomes an instance of a prototype with an object for each
/// material; a name that no part has is an "unknown_reference". Returns no issue if `scene` then has no meshes of files
/// and passes `validate`, counts included. Otherwise all issues: "bad_asset" at the first mesh of each file that cannot
/// be read (the sentence begins with the file's name and the place in it), else those of `validate`; the scene must
/// then be discarded. Precondition: `validate` accepts `scene`. Never throws; any bytes.
std::vector<tracer::Issue> load_meshes(tracer::Scene& scene, const tracer::Assets& assets,
                                       const tracer::Limits& limits);

}  // namespace api
