#include "api/src/gltf/nodes.h"

#include <array>
#include <span>

#include "api/src/reader/transform_product.h"

namespace api::gltf {
namespace {

using tracer::Transform;

Transform read_matrix(File& file, const Cursor& at) {
  Transform local;
  std::array<double, 16> m{};  // columns
  file.numbers(at, m);
  if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
    file.refuse(at, "the last row must be 0, 0, 0, 1: transforms are affine");
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
    while (!stack_.empty() && !file_.failed()) {
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
    for (auto at = indices.rbegin(); at != indices.rend() && !file_.failed(); ++at) {
      const std::size_t node = read_index(*at);
      if (reached_[node]) file_.refuse(*at, "the node is reached twice: nodes must make a tree, without circles");
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
      if (file_.meshes().empty()) file_.refuse(*mesh, "there are no meshes");
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

}  // namespace

std::vector<Placement> read_placements(File& file) {
  std::vector<Placement> placements;
  if (!file.nodes().empty()) {
    TreeWalk(file, placements).run();
  } else {
    for (std::uint32_t mesh = 0; mesh < file.meshes().size(); ++mesh) placements.push_back({mesh, {}});
  }
  return placements;
}

}  // namespace api::gltf
