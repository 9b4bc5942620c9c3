#include "tracer/src/certify/box_tree.h"

#include <algorithm>

#include "tracer/src/accel/primitive_bounds.h"

namespace tracer {

BoxTree::BoxTree(const GeometrySet& geometry, const RenderControl& control) {
  std::vector<Node> leaves;
  for (std::uint32_t number = 0; number < geometry.plane_geometry(); ++number)  // those below it are of finite shapes
    for (std::uint32_t i = 0; i < geometry.primitive_count(number); ++i) {
      const Node& leaf = leaves.emplace_back(Node{bounds_of(geometry, {number, i}), {number, i}});
      reach_ = std::max({reach_, largest_component(leaf.box.low), largest_component(leaf.box.high)});
    }
  nodes_.reserve(2 * leaves.size());
  if (!leaves.empty()) build(leaves, control);
}

/// Splits at the median of the centers along the longest axis.
void BoxTree::build(std::span<Node> leaves, const RenderControl& control) {
  const std::size_t own = nodes_.size();
  Bounds box, centers;
  for (const Node& leaf : leaves) {
    box.include(leaf.box);
    centers.include(leaf.box.low + leaf.box.high);
  }
  nodes_.push_back(leaves.size() == 1 ? leaves.front() : Node{box});
  if (leaves.size() > 1 && !control.cancelled()) {
    const Vec3 size = centers.high - centers.low;
    double Vec3::*const axis = size.x >= size.y && size.x >= size.z ? &Vec3::x : size.y >= size.z ? &Vec3::y : &Vec3::z;
    const auto key = [axis](const Node& leaf) {
      return std::tuple(leaf.box.low.*axis + leaf.box.high.*axis, leaf.primitive.geometry, leaf.primitive.primitive);
    };
    const std::size_t half = leaves.size() / 2;
    std::ranges::nth_element(leaves, leaves.begin() + static_cast<std::ptrdiff_t>(half), {}, key);
    build(leaves.first(half), control);
    build(leaves.subspan(half), control);
  }
  nodes_[own].next = static_cast<std::uint32_t>(nodes_.size());
}

}  // namespace tracer
