#include "api/load_assets.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <new>
#include <set>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <variant>

#include "api/reader/cursor.h"
#include "api/reader/issue_text.h"
#include "api/src/gltf/gltf.h"
#include "tracer/mesh_file.h"

namespace api {
namespace {

constexpr std::size_t issues_max = 1000;  // as for the other kinds of issues

/// Calls visit(object, its mesh, its pointer) for each object that is a mesh, in objects and prototypes.
template <class Scene, class Visit>
void for_each_mesh(Scene& scene, const Visit& visit) {
  const auto visit_list = [&](auto& objects, const std::string& pointer) {
    for (std::size_t i = 0; i < objects.size(); ++i)
      if (auto* mesh = std::get_if<tracer::Mesh>(&objects[i].shape))
        visit(objects[i], *mesh, pointer + "/" + std::to_string(i));
  };
  visit_list(scene.objects, "/objects");
  for (auto& prototype : scene.prototypes) visit_list(prototype.objects, prototype.path);
}

/// The meshes that one asset becomes.
struct Uses {
  std::vector<tracer::Mesh*> meshes;
  std::string pointer;  ///< JSON pointer of the file in the first one
};

/// Reads the file of a mesh, with its `smooth` and `time`.
tracer::Result<tracer::Mesh, std::string> read_mesh(const tracer::Mesh& wanted, const tracer::Scene& scene,
                                                    const tracer::Assets& assets, const tracer::Limits& limits) {
  const auto content = [&](tracer::AssetId id) {
    return id.index < assets.bytes.size() ? std::span<const std::uint8_t>(assets.bytes[id.index])
                                          : std::span<const std::uint8_t>();
  };
  const std::span<const std::uint8_t> bytes = content(*wanted.file);
  if (!gltf::is_gltf(bytes)) return tracer::read_mesh_file(bytes, limits, wanted.smooth);
  std::vector<std::span<const std::uint8_t>> buffers;
  for (const tracer::AssetId buffer : scene.assets[wanted.file->index].buffers) buffers.push_back(content(buffer));
  auto mesh = gltf::read_gltf({bytes, buffers, wanted.time}, limits);
  if (mesh) mesh->smooth = wanted.smooth;
  return mesh;
}

/// Replaces the geometry of one use and keeps its own materials of parts.
void replace(tracer::Mesh& use, tracer::Mesh mesh) {
  mesh.part_materials = std::move(use.part_materials);
  use = std::move(mesh);
}

/// Copies the mesh to all uses but the last and moves it there; false if that exceeds the limit of triangles. There is
/// at least one use.
bool assign(tracer::Mesh mesh, const std::vector<tracer::Mesh*>& uses, std::uint64_t& triangles,
            const tracer::Limits& limits) {
  triangles += mesh.triangles.size() * uses.size();
  if (triangles > limits.triangles) return false;
  for (tracer::Mesh* const use : std::span(uses).first(uses.size() - 1)) replace(*use, mesh);
  replace(*uses.back(), std::move(mesh));
  return true;
}

/// The materials that a file names, as the end of a sentence.
std::string text_of_names(const std::set<std::string_view>& names) {
  constexpr std::size_t names_max = 10;
  if (names.empty()) return "it names none";
  const std::vector<std::string_view> first(
      names.begin(), std::next(names.begin(), static_cast<std::ptrdiff_t>(std::min(names.size(), names_max))));
  return "it names " + list_of(first) + (names.size() > names_max ? " and others" : "");
}

/// Splits the meshes that have materials for parts of their files: each becomes an instance of a prototype with an
/// object for each material, or takes the only material that it has.
class PartSplitter {
 public:
  PartSplitter(tracer::Scene& scene, const tracer::Limits& limits) : scene_(scene), limits_(limits) {}

  std::vector<tracer::Issue> run() {
    for_each_mesh(scene_, [&](tracer::Object& object, tracer::Mesh& mesh, const std::string& pointer) {
      if (mesh.part_materials.empty()) {
        mesh.parts = {};
      } else if (has_all_parts(mesh, pointer + "/materials")) {
        split(object, pointer);
      }
    });
    for (tracer::Prototype& prototype : prototypes_) scene_.prototypes.push_back(std::move(prototype));
    return std::move(issues_);
  }

 private:
  bool has_all_parts(const tracer::Mesh& mesh, const std::string& pointer) {
    std::set<std::string_view> names;
    for (const tracer::MeshPart& part : mesh.parts)
      if (!part.name.empty()) names.insert(part.name);
    bool all = true;
    for (const auto& [name, material] : mesh.part_materials) {
      if (names.contains(name)) continue;
      all = false;
      if (issues_.size() < issues_max)
        issues_.push_back({pointer + pointer_to_member({}, name), "unknown_reference",
                           "the file has no part of the material " + api::quoted(name) + ": " + text_of_names(names)});
    }
    return all;
  }

  void split(tracer::Object& object, const std::string& pointer) {
    auto& mesh = std::get<tracer::Mesh>(object.shape);
    const std::map<std::string, tracer::MaterialId> materials = std::move(mesh.part_materials);
    auto parts = tracer::split_by_material(
        std::move(mesh),
        [&](const std::string& name) {
          const auto found = materials.find(name);
          return found != materials.end() ? found->second : object.material;
        },
        limits_);
    if (parts.size() == 1) {
      object.material = parts[0].material;
      object.shape = std::move(parts[0].mesh);
      return;
    }
    tracer::Prototype prototype{.objects = {}, .path = pointer, .is_one_object = true};
    for (auto& [material, part] : parts) prototype.objects.push_back({std::move(part), material, {}});
    object.shape = tracer::Instance{{static_cast<std::uint32_t>(scene_.prototypes.size() + prototypes_.size())}, {}};
    prototypes_.push_back(std::move(prototype));
  }

  tracer::Scene& scene_;
  const tracer::Limits& limits_;
  std::vector<tracer::Prototype> prototypes_;
  std::vector<tracer::Issue> issues_;
};

std::vector<tracer::Issue> read_meshes(tracer::Scene& scene, const tracer::Assets& assets,
                                       const tracer::Limits& limits) {
  std::map<std::tuple<std::uint32_t, bool, std::optional<float>>, Uses> uses_of;  // by asset, `smooth` and `time`
  for_each_mesh(scene, [&](const tracer::Object&, tracer::Mesh& mesh, const std::string& pointer) {
    if (!mesh.file) return;
    Uses& uses = uses_of[{mesh.file->index, mesh.smooth, mesh.time}];
    if (uses.meshes.empty()) uses.pointer = pointer + "/file";
    uses.meshes.push_back(&mesh);
  });
  if (uses_of.empty()) return {};
  std::vector<tracer::Issue> issues;
  std::uint64_t triangles = 0;
  for (auto& [key, uses] : uses_of) {
    auto mesh = read_mesh(*uses.meshes.front(), scene, assets, limits);
    if (!mesh) {
      issues.push_back({uses.pointer, "bad_asset", scene.assets[std::get<0>(key)].name + ": " + mesh.error()});
    } else if (!assign(std::move(*mesh), uses.meshes, triangles, limits)) {
      issues.push_back(
          {"/objects", "limit_exceeded",
           "the limit triangles is " + std::to_string(limits.triangles) + ", the meshes of files have more"});
      break;
    }
  }
  if (issues.empty()) issues = PartSplitter(scene, limits).run();
  return issues.empty() ? tracer::validate(scene, limits) : issues;
}

/// Images within glTF files become assets of their own.
std::vector<tracer::Issue> extract_images(tracer::Scene& scene, tracer::Assets& assets) {
  std::map<std::uint32_t, std::map<std::uint32_t, tracer::AssetId>> found;  // by file and image
  std::vector<tracer::Issue> issues;
  for (tracer::Texture& texture : scene.textures) {
    auto* image = std::get_if<tracer::ImageTexture>(&texture.pattern);
    if (image == nullptr || !image->image) continue;
    const auto [place, is_new] = found[image->file.index].try_emplace(*image->image);
    if (is_new) {
      const std::string name = scene.assets[image->file.index].name;
      auto content = gltf::read_image(assets.bytes[image->file.index], *image->image);
      if (!content) {
        issues.push_back({texture.path + "/image", "bad_asset", name + ": " + content.error()});
        continue;
      }
      place->second = {static_cast<std::uint32_t>(scene.assets.size())};
      scene.assets.push_back({name + " image " + std::to_string(*image->image), texture.path + "/file"});
      assets.bytes.resize(scene.assets.size());
      assets.bytes.back() = *std::move(content);
    }
    image->file = place->second;
    image->image.reset();
  }
  return issues;
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
  for_each_mesh(scene, [&](const tracer::Object&, const tracer::Mesh& mesh, const std::string&) {
    if (!mesh.file) return;
    is_mesh[mesh.file->index] = true;
    for (const tracer::AssetId buffer : scene.assets[mesh.file->index].buffers) is_mesh[buffer.index] = true;
  });
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
  if (issues.empty()) issues = extract_images(scene, assets);
  if (issues.empty()) issues = load_meshes(scene, assets, limits);
  if (!issues.empty()) return issues;
  std::fill(is_image.begin(), is_image.end(), false);
  is_image.resize(assets.bytes.size());
  for (const tracer::Texture& texture : scene.textures)
    if (const auto* image = std::get_if<tracer::ImageTexture>(&texture.pattern)) is_image[image->file.index] = true;
  for (std::size_t i = 0; i < assets.bytes.size(); ++i)
    if (!is_image[i]) std::vector<std::uint8_t>().swap(assets.bytes[i]);  // frees the files of meshes
  return assets;
}

}  // namespace api
