#include <limits>
#include <utility>

#include "tracer/mesh_file.h"
#include "tracer/src/math/vec.h"

namespace tracer {
namespace {

/// Unit normals in place of those that the compiled mesh would have: they must not depend on the parts.
void add_smooth_normals(Mesh& mesh, const Limits& limits) {
  mesh.normals = area_weighted_normals(mesh);
  for (Vec3& normal : mesh.normals)
    if (dot(normal, normal) > 0) normal = normalize(normal);
  add_missing_normals(mesh, limits);
}

/// Copies triangles with their vertices.
class PartMesh {
 public:
  explicit PartMesh(const Mesh& whole) : whole_(whole), vertex_(whole.positions.size(), none) {}

  Mesh of(const std::vector<std::size_t>& triangles) {
    Mesh part;
    part.smooth = whole_.smooth;
    for (const std::size_t triangle : triangles) {
      auto& corners = part.triangles.emplace_back(whole_.triangles[triangle]);
      for (std::uint32_t& corner : corners) corner = vertex_of(corner, part);
      const std::vector<std::uint8_t>& continues = whole_.continues_polygon;
      if (!continues.empty()) part.continues_polygon.push_back(triangle < continues.size() ? continues[triangle] : 0);
    }
    for (const std::size_t triangle : triangles)
      for (const std::uint32_t corner : whole_.triangles[triangle]) vertex_[corner] = none;
    return part;
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t vertex_of(std::uint32_t corner, Mesh& part) {
    if (vertex_[corner] != none) return vertex_[corner];
    vertex_[corner] = static_cast<std::uint32_t>(part.positions.size());
    part.positions.push_back(whole_.positions[corner]);
    if (!whole_.normals.empty()) part.normals.push_back(whole_.normals[corner]);
    if (!whole_.uvs.empty()) part.uvs.push_back(whole_.uvs[corner]);
    return vertex_[corner];
  }

  const Mesh& whole_;
  std::vector<std::uint32_t> vertex_;  ///< index in the part, by that in the whole
};

}  // namespace

void begin_part(Mesh& mesh, const std::string& name) {
  const std::string& last = mesh.parts.empty() ? std::string() : mesh.parts.back().name;
  if (name != last) mesh.parts.push_back({name, mesh.triangles.size()});
}

std::vector<Vec3> area_weighted_normals(const Mesh& mesh) {
  std::vector<Vec3> normals(mesh.positions.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 weighted = cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
    normals[a] += weighted;
    normals[b] += weighted;
    normals[c] += weighted;
  }
  return normals;
}

std::vector<MaterialMesh> split_by_material(Mesh mesh, const std::function<MaterialId(const std::string&)>& material_of,
                                            const Limits& limits) {
  std::vector<MeshPart> parts = std::move(mesh.parts);
  mesh.parts.clear();
  mesh.file.reset();
  mesh.part_materials.clear();
  if (parts.empty() || parts.front().first > 0) parts.insert(parts.begin(), MeshPart{});
  std::vector<MaterialId> materials;
  std::vector<std::vector<std::size_t>> triangles;  // by index in `materials`
  std::map<std::uint32_t, std::size_t> place_of;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t last = i + 1 < parts.size() ? parts[i + 1].first : mesh.triangles.size();
    if (parts[i].first == last) continue;
    const MaterialId material = material_of(parts[i].name);
    const auto [place, is_new] = place_of.emplace(material.index, materials.size());
    if (is_new) {
      materials.push_back(material);
      triangles.emplace_back();
    }
    for (std::size_t t = parts[i].first; t < last; ++t) triangles[place->second].push_back(t);
  }
  std::vector<MaterialMesh> split;
  if (materials.size() == 1) {
    split.push_back({materials[0], std::move(mesh)});
    return split;
  }
  if (mesh.smooth && mesh.normals.empty()) add_smooth_normals(mesh, limits);
  PartMesh part(mesh);
  for (std::size_t i = 0; i < materials.size(); ++i) split.push_back({materials[i], part.of(triangles[i])});
  return split;
}

}  // namespace tracer
