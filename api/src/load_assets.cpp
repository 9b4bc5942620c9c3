#include "api/load_assets.h"

#include <map>
#include <new>
#include <span>
#include <utility>
#include <variant>

#include "api/src/gltf/gltf.h"
#include "tracer/mesh_file.h"

namespace api {
namespace {

constexpr std::size_t issues_max = 1000;  // as for the other kinds of issues

/// Calls visit(mesh, pointer of its file) for each mesh with a file, in objects and prototypes.
template <class Scene, class Visit>
void for_each_mesh_file(Scene& scene, const Visit& visit) {
  const auto visit_list = [&](auto& objects, const std::string& pointer) {
    for (std::size_t i = 0; i < objects.size(); ++i) {
      auto* mesh = std::get_if<tracer::Mesh>(&objects[i].shape);
      if (mesh != nullptr && mesh->file) visit(*mesh, pointer + "/" + std::to_string(i) + "/file");
    }
  };
  visit_list(scene.objects, "/objects");
  for (auto& prototype : scene.prototypes) visit_list(prototype.objects, prototype.path);
}

/// The meshes that one asset becomes.
struct Uses {
  std::vector<tracer::Mesh*> meshes;
  std::string pointer;  ///< JSON pointer of the file in the first one
};

tracer::Result<tracer::Mesh, std::string> read_mesh(std::span<const std::uint8_t> bytes, const tracer::Limits& limits,
                                                    bool smooth) {
  if (!gltf::is_gltf(bytes)) return tracer::read_mesh_file(bytes, limits, smooth);
  auto mesh = gltf::read_gltf(bytes, limits);
  if (mesh) mesh->smooth = smooth;
  return mesh;
}

/// Copies the mesh to all uses but the last and moves it there; false if that exceeds the limit of triangles.
bool assign(tracer::Mesh mesh, const std::vector<tracer::Mesh*>& uses, std::uint64_t& triangles,
            const tracer::Limits& limits) {
  triangles += mesh.triangles.size() * uses.size();
  if (triangles > limits.triangles) return false;
  for (std::size_t i = 0; i + 1 < uses.size(); ++i) *uses[i] = mesh;
  *uses.back() = std::move(mesh);
  return true;
}

std::vector<tracer::Issue> read_meshes(tracer::Scene& scene, const tracer::Assets& assets,
                                       const tracer::Limits& limits) {
  std::map<std::pair<std::uint32_t, bool>, Uses> uses_of;  // by asset and `smooth`
  for_each_mesh_file(scene, [&](tracer::Mesh& mesh, const std::string& pointer) {
    Uses& uses = uses_of[{mesh.file->index, mesh.smooth}];
    if (uses.meshes.empty()) uses.pointer = pointer;
    uses.meshes.push_back(&mesh);
  });
  if (uses_of.empty()) return {};
  std::vector<tracer::Issue> issues;
  std::uint64_t triangles = 0;
  for (auto& [asset, uses] : uses_of) {
    const auto& [index, smooth] = asset;
    std::span<const std::uint8_t> bytes;
    if (index < assets.bytes.size()) bytes = assets.bytes[index];
    auto mesh = read_mesh(bytes, limits, smooth);
    if (!mesh) {
      issues.push_back({uses.pointer, "bad_asset", scene.assets[index].name + ": " + mesh.error()});
    } else if (!assign(std::move(*mesh), uses.meshes, triangles, limits)) {
      issues.push_back(
          {"/objects", "limit_exceeded",
           "the limit triangles is " + std::to_string(limits.triangles) + ", the meshes of files have more"});
      break;
    }
  }
  return issues.empty() ? tracer::validate(scene, limits) : issues;
}

}  // namespace

std::vector<tracer::Issue> check_assets(const tracer::Scene& scene, const RefuseAsset& refuse) {
  std::vector<tracer::Issue> issues;
  std::size_t omitted = 0;
  for (const tracer::Asset& asset : scene.assets) {
    const std::string refusal = refuse(asset.name);
    if (refusal.empty()) continue;
    if (issues.size() < issues_max) {
      issues.push_back({asset.path, "bad_asset", asset.name + ": " + refusal});
    } else {
      ++omitted;
    }
  }
  if (omitted > 0) issues.push_back({"", "too_many_issues", "and " + std::to_string(omitted) + " more"});
  return issues;
}

std::vector<tracer::Issue> load_meshes(tracer::Scene& scene, const tracer::Assets& assets,
                                       const tracer::Limits& limits) {
  try {
    return read_meshes(scene, assets, limits);
  } catch (const std::bad_alloc&) {
    return {{"", "too_large", "the scene's meshes take more memory than is available"}};
  }
}

tracer::Result<tracer::Assets, std::vector<tracer::Issue>> load_assets(tracer::Scene& scene, const ReadAsset& read,
                                                                       const tracer::Limits& limits) {
  std::vector<bool> is_image(scene.assets.size()), is_mesh(scene.assets.size());
  for (const tracer::Texture& texture : scene.textures)
    if (const auto* image = std::get_if<tracer::ImageTexture>(&texture.pattern)) is_image[image->file.index] = true;
  for_each_mesh_file(scene, [&](const tracer::Mesh& mesh, const std::string&) { is_mesh[mesh.file->index] = true; });
  tracer::Assets assets;
  std::vector<tracer::Issue> issues = check_assets(scene, [&](const std::string& name) {
    const std::size_t index = assets.bytes.size();
    std::vector<std::uint8_t>& bytes = assets.bytes.emplace_back();
    if (!is_image[index] && !is_mesh[index]) return std::string();
    AssetBytes content = read(name);
    if (!content) return content.error();
    bytes = std::move(*content);
    return std::string();
  });
  if (issues.empty()) issues = load_meshes(scene, assets, limits);
  if (!issues.empty()) return issues;
  for (std::size_t i = 0; i < assets.bytes.size(); ++i)
    if (!is_image[i]) std::vector<std::uint8_t>().swap(assets.bytes[i]);  // frees the files of meshes
  return assets;
}

}  // namespace api
