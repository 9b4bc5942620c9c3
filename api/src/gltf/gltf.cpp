#include "api/src/gltf/gltf.h"

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

/// Wider than for scene documents: a buffer may be one string, and `extras` may contain anything.
constexpr DocumentLimits json_limits{.bytes = 256'000'000, .depth = 64, .string_bytes = 256'000'000, .key_bytes = 4096};

/// True for extensions that do not change the triangles: materials, textures and lights are not read, and quantised
/// attributes are read as any others.
bool is_optional_extension(std::string_view extension) {
  for (const std::string_view prefix :
       {"KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_mesh_quantization"})
    if (extension.starts_with(prefix)) return true;
  return false;
}

void check_version_and_extensions(File& file) {
  const auto asset = file.member(file.root(), "asset");
  const auto version = asset ? file.member(*asset, "version") : std::nullopt;
  if (!version) {
    file.refuse(file.root(), "must be a glTF file, whose \"asset\" has a \"version\"");
  } else if (version->node->kind != json::Kind::string || !version->node->string().starts_with("2.")) {
    file.refuse(*version, "must be 2.x, got " + describe(*version->node));
  }
  for (const Cursor& at : file.list(file.root(), "extensionsRequired")) {
    const std::string_view name = at.node->kind == json::Kind::string ? at.node->string() : "";
    if (!is_optional_extension(name)) file.refuse(at, "the file needs the extension " + quoted(name));
  }
}

/// Counts before anything is placed: a small file may place one mesh very often.
void check_counts(File& file, const std::vector<std::vector<Primitive>>& meshes,
                  const std::vector<Placement>& placements, const tracer::Limits& limits) {
  std::vector<std::uint64_t> triangles;
  for (const std::vector<Primitive>& parts : meshes) {
    triangles.push_back(0);
    for (const Primitive& part : parts) triangles.back() += part.triangles();
  }
  const auto check = [&](const char* limit, std::uint64_t bound, std::uint64_t count, const char* unit) {
    if (count > bound)
      file.refuse(file.root(), "the limit " + std::string(limit) + " is " + std::to_string(bound) +
                                   ", its nodes place at least " + std::to_string(count) + unit);
  };
  std::uint64_t total = 0, parts = 0;
  for (std::size_t i = 0; i < placements.size() && !file.failed(); ++i) {
    check("triangles", limits.triangles, total += triangles[placements[i].mesh], "");
    check("objects", limits.objects, parts += meshes[placements[i].mesh].size(), " primitives");
  }
  if (total == 0) file.refuse(file.root(), "has no triangles");
}

bool read_mesh(File& file, const tracer::Limits& limits, tracer::Mesh& mesh) {
  check_version_and_extensions(file);
  if (!file.failed()) file.open();
  if (file.failed()) return false;
  std::vector<std::vector<Primitive>> meshes;
  for (const Cursor& at : file.meshes()) meshes.push_back(read_primitives(file, at));
  const std::vector<Placement> placements = read_placements(file);
  if (file.failed()) return false;
  check_counts(file, meshes, placements, limits);
  if (file.failed()) return false;
  for (const Placement& placement : placements)
    for (const Primitive& part : meshes[placement.mesh])
      if (!append_primitive(file, part, placement.world_from_node, limits, mesh)) return false;
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
    return std::string("takes more memory than is available");
  }
}

}  // namespace api::gltf
