#include "api/load_meshes.h"

#include <map>
#include <new>
#include <span>
#include <string>
#include <utility>

#include "api/src/gltf/gltf.h"
#include "tracer/mesh_file.h"

namespace api {
namespace {

using Bytes = std::span<const std::uint8_t>;

struct Use {
  tracer::Mesh* mesh;
  std::string pointer;  ///< of its file
};
/// By asset, and whether it is wanted smooth.
using UsesOfAssets = std::map<std::pair<std::uint32_t, bool>, std::vector<Use>>;

void find_uses(std::vector<tracer::Object>& objects, const std::string& pointer, UsesOfAssets& uses) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    auto* mesh = std::get_if<tracer::Mesh>(&objects[i].shape);
    if (mesh == nullptr || !mesh->file) continue;
    uses[{mesh->file->index, mesh->smooth}].push_back({mesh, pointer + "/" + std::to_string(i) + "/file"});
  }
}

tracer::Result<tracer::Mesh, std::string> read(Bytes bytes, const tracer::Limits& limits, bool smooth) {
  if (!gltf::is_gltf(bytes)) return tracer::read_mesh_file(bytes, limits, smooth);
  auto mesh = gltf::read_gltf(bytes, limits);
  if (mesh) mesh->smooth = smooth;
  return mesh;
}

/// Copies for all but the last, while the scene's meshes stay within the limit of triangles.
bool hand_out(tracer::Mesh read, std::vector<Use>& uses, std::uint64_t& triangles, const tracer::Limits& limits) {
  triangles += read.triangles.size() * uses.size();
  if (triangles > limits.triangles) return false;
  for (std::size_t i = 0; i + 1 < uses.size(); ++i) *uses[i].mesh = read;
  *uses.back().mesh = std::move(read);
  return true;
}

std::vector<tracer::Issue> load(tracer::Scene& scene, const tracer::Assets& assets, const tracer::Limits& limits) {
  UsesOfAssets uses_of_assets;
  find_uses(scene.objects, "/objects", uses_of_assets);
  for (tracer::Prototype& prototype : scene.prototypes) find_uses(prototype.objects, prototype.path, uses_of_assets);
  if (uses_of_assets.empty()) return {};
  std::vector<tracer::Issue> issues;
  std::uint64_t triangles = 0;
  for (auto& [asset, uses] : uses_of_assets) {
    const auto& [index, smooth] = asset;
    auto mesh = read(index < assets.bytes.size() ? Bytes(assets.bytes[index]) : Bytes(), limits, smooth);
    if (!mesh) {
      issues.push_back({uses.front().pointer, "bad_asset", scene.assets[index].name + ": " + mesh.error()});
    } else if (!hand_out(std::move(*mesh), uses, triangles, limits)) {
      issues.push_back(
          {"/objects", "limit_exceeded",
           "the limit triangles is " + std::to_string(limits.triangles) + ", the meshes of files have more"});
      break;
    }
  }
  return issues.empty() ? tracer::validate(scene, limits) : issues;
}

}  // namespace

std::vector<tracer::Issue> load_meshes(tracer::Scene& scene, const tracer::Assets& assets,
                                       const tracer::Limits& limits) {
  try {
    return load(scene, assets, limits);
  } catch (const std::bad_alloc&) {
    return {{"", "too_large", "the scene's meshes take more memory than there is"}};
  }
}

}  // namespace api
