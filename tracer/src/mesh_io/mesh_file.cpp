#include "tracer/mesh_file.h"

#include <new>

#include "tracer/src/math/vec.h"
#include "tracer/src/mesh_io/formats.h"

namespace tracer {
namespace {

using mesh_io::Bytes;

mesh_io::MeshResult read(Bytes bytes, const Limits& limits, bool smooth) {
  if (bytes.empty()) return std::string("is empty");
  if (mesh_io::is_ply(bytes)) return mesh_io::read_ply(bytes, limits);
  if (mesh_io::is_binary_stl(bytes)) return mesh_io::read_binary_stl(bytes, limits);
  if (mesh_io::is_ascii_stl(bytes)) return mesh_io::read_ascii_stl(bytes, limits);
  if (mesh_io::is_obj(bytes)) return mesh_io::read_obj(bytes, limits, smooth);
  return std::string(
      "is no OBJ, PLY, STL or glTF file (a binary STL has 84 bytes and 50 for each triangle it declares)");
}

}  // namespace

Result<Mesh, std::string> read_mesh_file(std::span<const std::uint8_t> bytes, const Limits& limits, bool smooth) {
  try {
    auto mesh = read(bytes, limits, smooth);
    if (mesh) mesh->smooth = smooth;
    return mesh;
  } catch (const std::bad_alloc&) {
    return std::string("takes more memory than there is");
  }
}

void add_missing_normals(Mesh& mesh, const Limits& limits) {
  if (mesh.normals.empty()) return;
  std::vector<bool> missing;
  missing.reserve(mesh.normals.size());
  bool any = false;
  for (const Vec3& normal : mesh.normals) {
    missing.push_back(!(max_component(abs(normal)) >= limits.length_min));
    any |= missing.back();
  }
  if (!any) return;
  for (auto& triangle : mesh.triangles) {
    const Vec3 a = mesh.positions[triangle[0]];
    const Vec3 across = cross(normalize(mesh.positions[triangle[1]] - a), normalize(mesh.positions[triangle[2]] - a));
    // No ray intersects a degenerate face: any direction is valid.
    const Vec3 normal = max_component(abs(across)) > 0 ? normalize(across) : Vec3{0, 0, 1};
    for (std::uint32_t& corner : triangle) {
      if (corner >= missing.size() || !missing[corner]) continue;
      if (max_component(abs(mesh.normals[corner])) < limits.length_min) {  // the first such face keeps the vertex
        mesh.normals[corner] = normal;
      } else if (mesh.normals[corner] != normal) {
        mesh.positions.push_back(mesh.positions[corner]);
        if (!mesh.uvs.empty()) mesh.uvs.push_back(mesh.uvs[corner]);
        mesh.normals.push_back(normal);
        corner = static_cast<std::uint32_t>(mesh.positions.size() - 1);
      }
    }
  }
}

}  // namespace tracer
