#include "api/src/gltf/gltf.h"

#include <array>
#include <new>
#include <ranges>
#include <span>

#include "api/reader/issue_text.h"
#include "api/reader/json_parser.h"
#include "api/src/gltf/file.h"
#include "api/src/gltf/primitives.h"
#include "api/src/reader/sections.h"
#include "tracer/mesh_file.h"

namespace api::gltf {
namespace {

using tracer::Transform;

Transform read_matrix(File& file, const Cursor& at) {
  Transform local;
  std::array<double, 16> m{};  // columns
  file.numbers(at, m);
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
    refuse(at, "the last row must be 0, 0, 0, 1: transforms are affine");
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) local.rows[i][j] = m[4 * j + i];
  return local;
}

/// Scale, then rotation by the unit quaternion x, y, z, w, then translation (section 3.5.3).
Transform read_steps(File& file, const Cursor& node) {
  const auto read = [&](std::string_view name, std::span<double> values) {
    if (const auto at = file.member(node, name)) file.numbers(*at, values);
  };
  std::array<double, 3> translation{}, scale{1, 1, 1};
  std::array<double, 4> quaternion{0, 0, 0, 1};
  read("translation", translation);
  read("rotation", quaternion);
  read("scale", scale);
  const auto [x, y, z, w] = quaternion;
  const std::array<std::array<double, 3>, 3> rotation{
      {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
       {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
       {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
  Transform local;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) local.rows[i][j] = rotation[i][j] * scale[j];
    local.rows[i][3] = translation[i];
  }
  return local;
}

struct Placement {
  std::uint32_t mesh = 0;
  Transform world_from_node{};
};

/// Depth first with a stack of its own: trees of any depth.
class TreeWalk {
 public:
  TreeWalk(File& file, std::vector<Placement>& placements)
      : file_(file), placements_(placements), reached_(file.nodes().size()) {}

  void run() {
    const std::vector<Cursor> scenes = file_.list(file_.root(), "scenes");
    if (scenes.empty()) {
      push_roots();
    } else {
      push(file_.list(scenes[file_.integer_or(file_.root(), "scene", scenes.size() - 1, 0)], "nodes"), {});
    }
    while (!stack_.empty()) {
      const Visit visit = stack_.back();
      stack_.pop_back();
      place(visit);
    }
  }

 private:
  struct Visit {
    std::size_t node;
    Transform world_from_parent;
  };

  std::size_t read_index(const Cursor& at) { return file_.integer(at, reached_.size() - 1); }

  /// The nodes that are no node's child.
  void push_roots() {
    std::vector<bool> is_child(reached_.size());
    for (const Cursor& node : file_.nodes())
      for (const Cursor& child : file_.list(node, "children")) is_child[read_index(child)] = true;
    for (std::size_t node = 0; node < is_child.size(); ++node) {
      if (is_child[node]) continue;
      reached_[node] = true;
      stack_.push_back({node, {}});
    }
  }

  /// The first node ends on top.
  void push(const std::vector<Cursor>& indices, const Transform& world_from_parent) {
    for (const Cursor& at : std::ranges::reverse_view(indices)) {
      const std::size_t node = read_index(at);
      if (reached_[node]) refuse(at, "the node is reached twice: nodes must make a tree, without circles");
      reached_[node] = true;
      stack_.push_back({node, world_from_parent});
    }
  }

  void place(const Visit& visit) {
    const Cursor& node = file_.nodes()[visit.node];
    const auto matrix = file_.member(node, "matrix");
    const Transform local = matrix ? read_matrix(file_, *matrix) : read_steps(file_, node);
    const Transform world_from_node = composed(visit.world_from_parent, local);
    if (const auto mesh = file_.member(node, "mesh")) {
      if (file_.meshes().empty()) refuse(*mesh, "there are no meshes");
      const std::uint64_t index = file_.integer(*mesh, file_.meshes().size() - 1);
      placements_.push_back({static_cast<std::uint32_t>(index), world_from_node});
    }
    push(file_.list(node, "children"), world_from_node);
  }

  File& file_;
  std::vector<Placement>& placements_;
  std::vector<bool> reached_;
  std::vector<Visit> stack_;
};

/// In the order of a walk through the scene's tree, parents first; without nodes, each mesh once. A node that is
/// reached twice, in a cycle or from two parents, is an error (section 3.5.2).
std::vector<Placement> read_placements(File& file) {
  std::vector<Placement> placements;
  if (!file.nodes().empty()) {
    TreeWalk(file, placements).run();
  } else {
    for (std::uint32_t mesh = 0; mesh < file.meshes().size(); ++mesh) placements.push_back({mesh, {}});
  }
  return placements;
}

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
    refuse(file.root(), "must be a glTF file, whose \"asset\" has a \"version\"");
  } else if (version->node->kind != json::Kind::string || !version->node->string().starts_with("2.")) {
    refuse(*version, "must be 2.x, got " + describe(*version->node));
  }
  for (const Cursor& at : file.list(file.root(), "extensionsRequired")) {
    const std::string_view name = at.node->kind == json::Kind::string ? at.node->string() : "";
    if (!is_optional_extension(name)) refuse(at, "the file needs the extension " + quoted(name));
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
      refuse(file.root(), "the limit " + std::string(limit) + " is " + std::to_string(bound) +
                              ", its nodes place at least " + std::to_string(count) + unit);
  };
  std::uint64_t total = 0, parts = 0;
  for (const Placement& placement : placements) {
    check("triangles", limits.triangles, total += triangles[placement.mesh], "");
    check("objects", limits.objects, parts += meshes[placement.mesh].size(), " primitives");
  }
  if (total == 0) refuse(file.root(), "has no triangles");
}

tracer::Mesh read_mesh(File& file, const tracer::Limits& limits) {
  check_version_and_extensions(file);
  file.open();
  std::vector<std::vector<Primitive>> meshes;
  for (const Cursor& at : file.meshes()) meshes.push_back(read_primitives(file, at));
  const std::vector<Placement> placements = read_placements(file);
  check_counts(file, meshes, placements, limits);
  tracer::Mesh mesh;
  for (const Placement& placement : placements)
    for (const Primitive& part : meshes[placement.mesh])
      append_primitive(part, placement.world_from_node, limits, mesh);
  tracer::add_missing_normals(mesh, limits);
  return mesh;
}

tracer::Mesh read(Bytes bytes, const tracer::Limits& limits) {
  const Container container = open_container(bytes);
  auto tape = json::parse(container.json, json_limits);
  if (!tape)
    throw GltfError("byte " + std::to_string(container.json_offset + tape.error().offset) + ": " + tape.error().detail);
  File file(std::move(*tape), container.binary);
  return read_mesh(file, limits);
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

tracer::Result<tracer::Mesh, std::string> read_gltf(Bytes bytes, const tracer::Limits& limits) {
  try {
    return read(bytes, limits);
  } catch (const GltfError& error) {
    return std::string(error.what());
  } catch (const std::bad_alloc&) {
    return std::string("takes more memory than is available");
  }
}

}  // namespace api::gltf
