#include "api/src/gltf/gltf.h"

#include <deque>
#include <new>

#include "api/src/gltf/container.h"
#include "api/src/gltf/file.h"
#include "api/src/gltf/nodes.h"
#include "api/src/gltf/primitives.h"
#include "api/src/json/json_parser.h"
#include "api/src/reader/issue_text.h"
#include "tracer/mesh_file.h"

namespace api::gltf {
namespace {

using MeshOrRefusal = tracer::Result<tracer::Mesh, std::string>;

/// A buffer may be one string, and what programs add (`extras`) is theirs: wider than a scene document's.
constexpr DocumentLimits json_limits{.bytes = 256'000'000, .depth = 64, .string_bytes = 256'000'000, .key_bytes = 4096};

/// Without those, the mesh would be another than its author made. Extensions of materials, textures and lights change
/// nothing that is read here; quantised attributes are read as any others.
bool is_optional_extension(std::string_view extension) {
  for (const std::string_view prefix :
       {"KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_mesh_quantization"})
    if (extension.starts_with(prefix)) return true;
  return false;
}

bool check_version_and_extensions(File& file) {
  const auto asset = file.member(file.root(), "asset");
  const auto version = asset ? file.member(*asset, "version") : std::nullopt;
  if (!version) return file.refuse(file.root(), "must be a glTF file, whose \"asset\" has a \"version\"");
  if (version->node->kind != json::Kind::string || !version->node->string().starts_with("2."))
    return file.refuse(*version, "must be 2.x, got " + describe(*version->node));
  List required;
  if (!file.list("extensionsRequired", required)) return false;
  for (const Cursor& at : required.elements) {
    const std::string_view name = at.node->kind == json::Kind::string ? at.node->string() : "";
    if (!is_optional_extension(name)) return file.refuse(at, "the file needs the extension " + quoted(name));
  }
  return true;
}

/// Counted before anything is placed: a small file may put one mesh in very many places.
bool check_counts(File& file, const std::deque<MeshParts>& meshes, const std::vector<Placement>& placements,
                  const tracer::Limits& limits) {
  std::vector<std::uint64_t> triangles;
  for (const MeshParts& parts : meshes) {
    triangles.push_back(0);
    for (const Primitive& part : parts.primitives) triangles.back() += part.triangles();
  }
  std::uint64_t total = 0, parts = 0;
  for (const Placement& placement : placements) {
    total += triangles[placement.mesh];
    parts += meshes[placement.mesh].primitives.size();
    if (total > limits.triangles)
      return file.refuse(file.root(), "the limit triangles is " + std::to_string(limits.triangles) +
                                          ", its nodes place at least " + std::to_string(total));
    if (parts > limits.objects)
      return file.refuse(file.root(), "the limit objects is " + std::to_string(limits.objects) +
                                          ", its nodes place at least " + std::to_string(parts) + " primitives");
  }
  return total > 0 || file.refuse(file.root(), "has no triangles");
}

bool read_mesh(File& file, const tracer::Limits& limits, tracer::Mesh& mesh) {
  if (!check_version_and_extensions(file) || !file.open()) return false;
  std::deque<MeshParts> meshes;  // stay where they are
  for (const Cursor& at : file.meshes().elements)
    if (!read_primitives(file, at, meshes.emplace_back())) return false;
  std::vector<Placement> placements;
  if (!read_placements(file, placements) || !check_counts(file, meshes, placements, limits)) return false;
  for (const Placement& placement : placements)
    for (const Primitive& part : meshes[placement.mesh].primitives)
      if (!place_primitive(file, part, placement.world_from_node, limits, mesh)) return false;
  tracer::add_missing_normals(mesh, limits);
  return true;
}

MeshOrRefusal read(Bytes bytes, const tracer::Limits& limits) {
  const auto container = open_container(bytes);
  if (!container) return container.error();
  auto tape = json::parse(container->json, json_limits);
  if (!tape) return "byte " + std::to_string(container->json_offset + tape.error().offset) + ": " + tape.error().detail;
  File file(std::move(*tape), container->binary);
  tracer::Mesh mesh;
  if (!read_mesh(file, limits, mesh)) return file.refusal();
  return mesh;
}

}  // namespace

bool is_gltf(Bytes bytes) {
  if (is_glb(bytes)) return true;
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());  // the same bytes as characters
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{';
}

MeshOrRefusal read_gltf(Bytes bytes, const tracer::Limits& limits) {
  try {
    return read(bytes, limits);
  } catch (const std::bad_alloc&) {
    return std::string("takes more memory than there is");
  }
}

}  // namespace api::gltf
