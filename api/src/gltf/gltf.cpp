#include "api/src/gltf/gltf.h"

#include "api/reader/issue_text.h"
#include "api/src/gltf/file.h"
#include "api/src/gltf/primitives.h"
#include "tracer/mesh_file.h"

namespace api::gltf {
namespace {

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
    refuse(file.root(), "must be a glTF file, whose \"asset\" has a \"version\"");
  } else if (version->node->kind != json::Kind::string || !version->node->string().starts_with("2.")) {
    refuse(*version, "must be 2.x, got " + describe(*version->node));
  }
  for (const Cursor& at : file.list(file.root(), "extensionsRequired")) {
    const std::string_view name = at.node->kind == json::Kind::string ? at.node->string() : "";
    if (!is_optional_extension(name)) refuse(at, "the file needs the extension " + quoted(name));
  }
}

/// A mesh and its place.
struct PlacedMesh {
  std::size_t mesh = 0;
  Placement at{};
};

/// Those of the nodes; without nodes, each mesh once.
std::vector<PlacedMesh> placed_meshes(File& file, std::optional<double> time) {
  std::vector<PlacedMesh> placed;
  if (file.all("nodes").empty())
    for (const Cursor& mesh : file.all("meshes")) placed.push_back({mesh.index, {}});
  for (Placement& placement : place_nodes(file, time))
    if (const auto mesh = file.member(placement.node, "mesh"))
      placed.push_back({file.target(*mesh, "meshes").index, std::move(placement)});
  return placed;
}

/// Counts before anything is placed: a small file may place one mesh very often.
void check_counts(File& file, const std::vector<std::vector<Primitive>>& meshes,
                  const std::vector<PlacedMesh>& placements, const tracer::Limits& limits) {
  std::vector<std::uint64_t> triangles;
  for (const std::vector<Primitive>& parts : meshes) {
    triangles.push_back(0);
    for (const Primitive& part : parts) triangles.back() += part.triangles();
  }
  const auto check = [&](const char* limit, std::uint64_t bound, std::uint64_t count, const char* unit) {
    if (count > bound)
      refuse(file.root(), "the limit " + std::string(limit) + " is " + std::to_string(bound) +
                              ", its nodes place at least " + std::to_string(count) + unit);
  };
  std::uint64_t total = 0, parts = 0;
  for (const PlacedMesh& placed : placements) {
    check("triangles", limits.triangles, total += triangles[placed.mesh], "");
    check("objects", limits.objects, parts += meshes[placed.mesh].size(), " primitives");
  }
  if (total == 0) refuse(file.root(), "has no triangles");
}

tracer::Mesh read(const Source& source, const tracer::Limits& limits) {
  File file(source.bytes, source.buffers);
  check_version_and_extensions(file);
  file.open();
  std::vector<std::vector<Primitive>> meshes;
  for (const Cursor& at : file.all("meshes")) meshes.push_back(read_primitives(file, at));
  const std::vector<PlacedMesh> placements = placed_meshes(file, source.time);
  check_counts(file, meshes, placements, limits);
  tracer::Mesh mesh;
  for (const PlacedMesh& placed : placements)
    for (const Primitive& part : meshes[placed.mesh]) append_primitive(part, placed.at, limits, mesh);
  tracer::add_missing_normals(mesh, limits);
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

tracer::Result<tracer::Mesh, std::string> read_gltf(const Source& source, const tracer::Limits& limits) {
  return result_of([&] { return read(source, limits); });
}

tracer::Result<std::vector<std::uint8_t>, std::string> read_image(Bytes bytes, std::uint32_t image) {
  return result_of([&] {
    File file(bytes, {});
    file.open();
    const std::vector<Cursor>& images = file.all("images");
    if (image >= images.size())
      refuse(file.root(), "the image " + std::to_string(image) + " is one of " + std::to_string(images.size()));
    const auto content = file.image(images[image]);
    if (!content) refuse(images[image], "is a file of its own");
    return std::vector<std::uint8_t>(content->begin(), content->end());
  });
}

}  // namespace api::gltf
