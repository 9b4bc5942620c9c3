#include "api/src/gltf/nodes.h"

#include <algorithm>
#include <array>
#include <span>

#include "api/src/reader/transform_product.h"

namespace api::gltf {
namespace {

using tracer::Transform;

class Walk {
 public:
  Walk(File& file, std::vector<Placement>& placements)
      : file_(file), placements_(placements), reached_(file.nodes().elements.size()) {}

  bool run() {
    if (file_.nodes().elements.empty()) {
      for (std::uint32_t mesh = 0; mesh < file_.meshes().elements.size(); ++mesh) placements_.push_back({mesh, {}});
      return true;
    }
    List scenes;
    if (!file_.list("scenes", scenes)) return false;
    if (!(scenes.elements.empty() ? add_all_roots() : add_scene(scenes))) return false;
    while (!waiting_.empty()) {
      const Visit visit = waiting_.back();
      waiting_.pop_back();
      if (!place(visit)) return false;
    }
    return true;
  }

 private:
  struct Visit {
    std::uint32_t node;
    Transform world_from_parent;
  };

  /// Those that are no node's child.
  bool add_all_roots() {
    std::vector<bool> is_child(reached_.size());
    for (const Cursor& node : file_.nodes().elements) {
      const auto children = file_.member(node, "children");
      std::vector<Cursor> elements;
      if (children && !file_.elements(*children, elements)) return false;
      for (const Cursor& element : elements) {
        std::uint64_t child = 0;
        if (!file_.integer(element, reached_.size() - 1, child)) return false;
        is_child[child] = true;
      }
    }
    for (std::uint32_t node = 0; node < is_child.size(); ++node) {
      if (is_child[node]) continue;
      reached_[node] = true;
      waiting_.push_back({node, {}});
    }
    return true;
  }

  bool add_scene(const List& scenes) {
    std::uint64_t scene = 0;
    if (!file_.optional_integer(file_.root(), "scene", scenes.elements.size() - 1, scene)) return false;
    const auto nodes = file_.member(scenes.elements[scene], "nodes");
    return !nodes || add(*nodes, {});
  }

  /// The nodes that an array names, last first: the one on top of the pile comes next.
  bool add(const Cursor& indices, const Transform& world_from_parent) {
    std::vector<Cursor> elements;
    if (!file_.elements(indices, elements)) return false;
    std::reverse(elements.begin(), elements.end());
    for (const Cursor& element : elements) {
      std::uint64_t node = 0;
      if (!file_.integer(element, reached_.size() - 1, node)) return false;
      if (reached_[node])
        return file_.refuse(element, "the node is reached twice: nodes must make a tree, without circles");
      reached_[node] = true;
      waiting_.push_back({static_cast<std::uint32_t>(node), world_from_parent});
    }
    return true;
  }

  bool place(const Visit& visit) {
    const Cursor& node = file_.nodes().elements[visit.node];
    Transform local;
    if (!read_transform(node, local)) return false;
    const Transform world_from_node = composed(visit.world_from_parent, local);
    if (const auto mesh = file_.member(node, "mesh")) {
      std::uint64_t index = 0;
      if (file_.meshes().elements.empty()) return file_.refuse(*mesh, "there are no meshes");
      if (!file_.integer(*mesh, file_.meshes().elements.size() - 1, index)) return false;
      placements_.push_back({static_cast<std::uint32_t>(index), world_from_node});
    }
    const auto children = file_.member(node, "children");
    return !children || add(*children, world_from_node);
  }

  bool read_transform(const Cursor& node, Transform& local) {
    const auto matrix = file_.member(node, "matrix");
    return matrix ? read_matrix(*matrix, local) : read_steps(node, local);
  }

  bool read_matrix(const Cursor& at, Transform& local) {
    std::array<double, 16> m{};  // by columns
    if (!file_.numbers(at, m)) return false;
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
      return file_.refuse(at, "the last row must be 0, 0, 0, 1: transforms are affine");
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 4; ++j) local.rows[i][j] = m[4 * j + i];
    return true;
  }

  bool optional_numbers(const Cursor& node, std::string_view name, std::span<double> values) {
    const auto at = file_.member(node, name);
    return !at || file_.numbers(*at, values);
  }

  /// Scaled, then turned by the unit quaternion x, y, z, w, then moved (section 3.5.3).
  bool read_steps(const Cursor& node, Transform& local) {
    std::array<double, 3> moved{}, scaled{1, 1, 1};
    std::array<double, 4> q{0, 0, 0, 1};
    if (!optional_numbers(node, "translation", moved) || !optional_numbers(node, "rotation", q) ||
        !optional_numbers(node, "scale", scaled))
      return false;
    const auto [x, y, z, w] = q;
    const std::array<std::array<double, 3>, 3> turned{
        {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
         {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
         {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) local.rows[i][j] = turned[i][j] * scaled[j];
      local.rows[i][3] = moved[i];
    }
    return true;
  }

  File& file_;
  std::vector<Placement>& placements_;
  std::vector<bool> reached_;
  std::vector<Visit> waiting_;
};

}  // namespace

bool read_placements(File& file, std::vector<Placement>& placements) { return Walk(file, placements).run(); }

}  // namespace api::gltf
