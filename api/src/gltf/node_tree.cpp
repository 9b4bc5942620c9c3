#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "api/src/gltf/file.h"
#include "api/src/reader/sections.h"

namespace api::gltf {
namespace {

using tracer::Transform;

Transform matrix_of(std::span<const double> m) {  // columns
  Transform transform;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) transform.rows[i][j] = m[4 * j + i];
  return transform;
}

/// The local transform of a node in parts.
struct Steps {
  std::array<double, 3> translation{}, scale{1, 1, 1};
  std::array<double, 4> rotation{0, 0, 0, 1};  ///< a quaternion x, y, z, w
  std::vector<double> weights{};

  /// Scale, then rotation by the unit quaternion, then translation (section 3.5.3).
  [[nodiscard]] Transform transform() const {
    const auto [x, y, z, w] = rotation;
    const std::array<std::array<double, 3>, 3> turned{
        {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
         {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
         {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}}};
    Transform local;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) local.rows[i][j] = turned[i][j] * scale[j];
      local.rows[i][3] = translation[i];
    }
    return local;
  }
};

Steps read_steps(File& file, const Cursor& node) {
  Steps steps;
  const auto read = [&](std::string_view name, std::span<double> values) {
    if (const auto at = file.member(node, name)) file.numbers(*at, values);
  };
  read("translation", steps.translation);
  read("rotation", steps.rotation);
  read("scale", steps.scale);
  const auto mesh = file.member(node, "mesh");
  const auto own = file.member(node, "weights");
  const auto of_mesh = mesh ? file.member(file.target(*mesh, "meshes"), "weights") : std::nullopt;
  for (const auto& at : {own, of_mesh})
    if (at && steps.weights.empty()) {
      steps.weights.resize(at->node->size);
      file.numbers(*at, steps.weights);
    }
  return steps;
}

/// Moves the nodes by the first animation.
class Animator {
 public:
  Animator(File& file, std::vector<Steps>& steps, double time) : file_(file), steps_(steps), time_(time) {}

  void run() {
    const std::vector<Cursor>& animations = file_.all("animations");
    if (animations.empty()) return;
    const std::vector<Cursor> samplers = file_.list(animations.front(), "samplers");
    for (const Cursor& channel : file_.list(animations.front(), "channels")) {
      const Cursor target = file_.required_member(channel, "target");
      const auto node = file_.member(target, "node");
      if (!node) continue;  // of an extension
      const std::string path = file_.text_or(target, "path", "");
      const Cursor index = file_.required_member(channel, "sampler");
      if (samplers.empty()) refuse(index, "there are no samplers");
      Steps& steps = steps_[file_.target(*node, "nodes").index];
      const std::vector<double> values =
          sample(samplers[file_.integer(index, samplers.size() - 1)], path == "rotation");
      if (path == "weights") steps.weights = values;
      if (path == "translation") copy(values, steps.translation, channel);
      if (path == "scale") copy(values, steps.scale, channel);
      if (path == "rotation") copy(values, steps.rotation, channel);
    }
  }

 private:
  static void copy(const std::vector<double>& values, std::span<double> to, const Cursor& at) {
    if (values.size() != to.size()) refuse(at, "its sampler has values of another size");
    std::copy(values.begin(), values.end(), to.begin());
  }

  /// Appendix C of the specification.
  std::vector<double> sample(const Cursor& sampler, bool is_rotation) {
    const Accessor &times = file_.accessor(file_.required_member(sampler, "input")),
                   &values = file_.accessor(file_.required_member(sampler, "output"));
    const std::string interpolation = file_.text_or(sampler, "interpolation", "LINEAR");
    const bool cubic = interpolation == "CUBICSPLINE";
    const std::size_t rows = values.count / times.count / (cubic ? 3 : 1);  // for each time
    if (times.components != 1 || rows == 0 || rows * times.count * (cubic ? 3 : 1) != values.count)
      refuse(sampler, "its output must have as many values for each of its times");
    std::size_t next = 0;
    while (next < times.count && times.value(next, 0) <= time_) ++next;
    const std::size_t after = std::min(next, times.count - 1), before = next == 0 ? 0 : next - 1;
    const double begin = times.value(before, 0), span = times.value(after, 0) - begin;
    const double t = span > 0 ? std::clamp((time_ - begin) / span, 0.0, 1.0) : 0;
    std::vector<double> result;
    const auto value = [&](std::size_t key, std::size_t part, std::size_t i) {
      const std::size_t row = (key * (cubic ? 3 : 1) + part) * rows + i / values.components;
      return values.value(row, i % values.components);
    };
    for (std::size_t i = 0; i < rows * values.components; ++i) {
      const double from = value(before, cubic ? 1 : 0, i), to = value(after, cubic ? 1 : 0, i);
      if (interpolation == "STEP") {
        result.push_back(t < 1 ? from : to);
      } else if (cubic) {
        const double out = span * value(before, 2, i), in = span * value(after, 0, i), t2 = t * t, t3 = t2 * t;
        result.push_back((2 * t3 - 3 * t2 + 1) * from + (t3 - 2 * t2 + t) * out + (3 * t2 - 2 * t3) * to +
                         (t3 - t2) * in);
      } else {
        result.push_back(std::lerp(from, to, t));
      }
    }
    if (is_rotation && result.size() == 4) make_rotation(values, before, after, t, interpolation, result);
    return result;
  }

  /// Along the shorter arc of two rotations (appendix C.4), at unit length.
  static void make_rotation(const Accessor& values, std::size_t before, std::size_t after, double t,
                            const std::string& interpolation, std::vector<double>& to) {
    double cosine = 0, length = 0;
    for (std::size_t i = 0; i < 4; ++i) cosine += values.value(before, i) * values.value(after, i);
    const double angle = std::acos(std::min(std::abs(cosine), 1.0));
    if (interpolation == "LINEAR" && angle > 1e-6)
      for (std::size_t i = 0; i < 4; ++i)
        to[i] = (std::sin((1 - t) * angle) * values.value(before, i) +
                 std::copysign(std::sin(t * angle), cosine) * values.value(after, i)) /
                std::sin(angle);
    for (const double value : to) length += value * value;
    for (double& value : to) value /= length > 0 ? std::sqrt(length) : 1;
  }

  File& file_;
  std::vector<Steps>& steps_;
  double time_;
};

/// Depth first with a stack of its own.
class TreeWalk {
 public:
  TreeWalk(File& file, std::optional<double> time) : file_(file), reached_(file.all("nodes").size()) {
    for (const Cursor& node : file.all("nodes")) steps_.push_back(read_steps(file, node));
    if (time) Animator(file, steps_, *time).run();
  }

  std::vector<Placement> run() {
    const std::vector<Cursor>& scenes = file_.all("scenes");
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
    for (Placement& placement : placements_) add_joints(placement);
    return std::move(placements_);
  }

 private:
  struct Visit {
    std::size_t node;
    Transform world_from_parent;
  };

  /// The nodes that are no node's child.
  void push_roots() {
    std::vector<bool> is_child(reached_.size());
    for (const Cursor& node : file_.all("nodes"))
      for (const Cursor& child : file_.list(node, "children")) is_child[file_.target(child, "nodes").index] = true;
    for (std::size_t node = is_child.size(); node-- > 0;) {
      if (is_child[node]) continue;
      reached_[node] = true;
      stack_.push_back({node, {}});
    }
  }

  /// The first node ends on top.
  void push(const std::vector<Cursor>& indices, const Transform& world_from_parent) {
    for (std::size_t at = indices.size(); at-- > 0;) {
      const std::size_t node = file_.target(indices[at], "nodes").index;
      if (reached_[node]) refuse(indices[at], "the node is reached twice: nodes must make a tree, without circles");
      reached_[node] = true;
      stack_.push_back({node, world_from_parent});
    }
  }

  void place(const Visit& visit) {
    const Cursor& node = file_.all("nodes")[visit.node];
    Transform local = steps_[visit.node].transform();
    if (const auto matrix = file_.member(node, "matrix")) {
      std::array<double, 16> m{};
      file_.numbers(*matrix, m);
      if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
        refuse(*matrix, "the last row must be 0, 0, 0, 1: transforms are affine");
      local = matrix_of(m);
    }
    const Transform world_from_node = composed(visit.world_from_parent, local);
    placements_.push_back({node, world_from_node, steps_[visit.node].weights, {}});
    world_[visit.node] = world_from_node;
    push(file_.list(node, "children"), world_from_node);
  }

  /// Section 3.7.3.3. Joints that are not in the scene stay where they are.
  void add_joints(Placement& placement) {
    const auto skin = file_.member(placement.node, "skin");
    if (!skin || !file_.member(placement.node, "mesh")) return;
    const Cursor& at = file_.target(*skin, "skins");
    const auto inverse = file_.member(at, "inverseBindMatrices");
    const Accessor* const binds = inverse ? &file_.accessor(*inverse) : nullptr;
    for (const Cursor& joint : file_.list(at, "joints")) {
      const auto world = world_.find(file_.target(joint, "nodes").index);
      Transform bind;
      if (binds != nullptr) {
        if (binds->components != 16 || joint.index >= binds->count) refuse(*inverse, "must have a MAT4 for each joint");
        std::array<double, 16> m{};
        for (std::size_t i = 0; i < m.size(); ++i) m[i] = binds->value(joint.index, i);
        bind = matrix_of(m);
      }
      placement.joints.push_back(world == world_.end() ? Transform{} : composed(world->second, bind));
    }
  }

  File& file_;
  std::vector<Steps> steps_;  ///< by node
  std::vector<bool> reached_;
  std::map<std::size_t, Transform> world_;  ///< by node, for those that are reached
  std::vector<Visit> stack_;
  std::vector<Placement> placements_;
};

}  // namespace

std::vector<Placement> place_nodes(File& file, std::optional<double> time) { return TreeWalk(file, time).run(); }

}  // namespace api::gltf
