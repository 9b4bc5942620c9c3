#include "tracer/src/certify/box_tree.h"

#include <span>

#include "tracer/src/accel/primitive_count.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/math/rounding.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {

Bounds bounds_of(const GeometrySet& geometry, const PrimitiveRef& primitive) {
  const auto [number, i] = primitive;
  Bounds box;
  switch (geometry.kind_of(number)) {
    case GeometryKind::spheres: {
      const SphereGeometry& spheres = geometry.spheres[number];
      const double radius = spheres.radius[i];
      box.include({spheres.x[i], spheres.y[i], spheres.z[i]}, {radius, radius, radius});
      break;
    }
    case GeometryKind::triangles: {
      const TriangleGeometry& mesh = geometry.mesh(number);
      for (const std::uint32_t vertex : mesh.triangles[i]) box.include(mesh.position(vertex));
      break;
    }
    case GeometryKind::quadrics: {
      const Quadric& quadric = geometry.quadric_set(number).quadrics[i];
      visit_kind(quadric.kind, [&](auto standard) { standard.include(box, quadric); });
      break;
    }
    case GeometryKind::planes:
      return box;
  }
  // Rounding of the bounds above, and hits beyond a rim (rim_slack, StandardShape::error).
  const double slack = std::max(largest_component(box.low), largest_component(box.high)) * 0x1p-40;
  return {box.low - Vec3{slack, slack, slack}, box.high + Vec3{slack, slack, slack}};
}

BoxTree::BoxTree(const GeometrySet& geometry, const RenderControl& control) {
  const std::uint32_t finite = geometry.plane_geometry();  // the numbers below it are of finite shapes
  std::size_t count = 0;
  for (std::uint32_t number = 0; number < finite; ++number) count += primitive_count(geometry, number);
  items_.reserve(count);
  primitives_.reserve(count);
  for (std::uint32_t number = 0; number < finite; ++number)
    for (std::uint32_t i = 0; i < primitive_count(geometry, number); ++i) {
      const PrimitiveRef primitive{number, i};
      const Bounds box = bounds_of(geometry, primitive);
      items_.push_back({{rounded_down(box.low.x), rounded_down(box.low.y), rounded_down(box.low.z)},
                        {rounded_up(box.high.x), rounded_up(box.high.y), rounded_up(box.high.z)},
                        static_cast<std::uint32_t>(primitives_.size())});
      primitives_.push_back(primitive);
      reach_ = std::max({reach_, largest_component(box.low), largest_component(box.high)});
    }
  nodes_.reserve(count / (width - 1) + 1);
  if (!items_.empty()) build(items_.data(), items_.data() + items_.size(), control);
  items_ = {};
}

/// Splits the items at the medians of their centers along the longest axis until at most eight parts are left. All
/// parts but the last are full.
std::uint32_t BoxTree::build(Item* first, Item* last, const RenderControl& control) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  Node& node = nodes_.emplace_back();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::fill_n(node.low[axis], width, HUGE_VALF);
    std::fill_n(node.high[axis], width, -HUGE_VALF);
  }
  const auto count = static_cast<std::size_t>(last - first);
  node.leaf = count <= width;
  if (node.leaf) {
    for (Item* item = first; item != last; ++item) set_child(number, item->number, item, item + 1);
    return number;
  }
  if (control.cancelled()) return number;
  std::size_t part = width;
  while (part * width < count) part *= width;
  const auto split = [&](const auto& self, Item* begin, Item* end) -> void {
    const auto items = static_cast<std::size_t>(end - begin);
    if (items <= part) {
      const std::uint32_t child = build(begin, end, control);
      set_child(number, child, begin, end);
      return;
    }
    float low[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF}, high[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};
    for (const Item& item : std::span(begin, end))
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float center = item.low[axis] + item.high[axis];
        low[axis] = std::min(low[axis], center);
        high[axis] = std::max(high[axis], center);
      }
    std::size_t longest = 0;
    for (std::size_t axis = 1; axis < 3; ++axis)
      if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
    Item* const middle = begin + (items / part + 1) / 2 * part;
    std::nth_element(begin, middle, end, [longest](const Item& a, const Item& b) {
      const float at_a = a.low[longest] + a.high[longest], at_b = b.low[longest] + b.high[longest];
      return at_a != at_b ? at_a < at_b : a.number < b.number;
    });
    self(self, begin, middle);
    self(self, middle, end);
  };
  split(split, first, last);
  return number;
}

void BoxTree::set_child(std::uint32_t node, std::uint32_t child, const Item* first, const Item* last) {
  Node& parent = nodes_[node];
  const std::uint32_t lane = parent.count++;
  parent.child[lane] = child;
  for (const Item& item : std::span(first, last))
    for (std::size_t axis = 0; axis < 3; ++axis) {
      parent.low[axis][lane] = std::min(parent.low[axis][lane], item.low[axis]);
      parent.high[axis][lane] = std::max(parent.high[axis][lane], item.high[axis]);
    }
}

WHITTLE_WIDE unsigned overlaps(const BoxTree::Node& node, const ConvexRegion& region) {
  constexpr unsigned width = BoxTree::width;
  int inside[width];
  std::fill_n(inside, width, -1);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float low = region.low()[axis], high = region.high()[axis];
    for (unsigned i = 0; i < width; ++i)
      inside[i] &= (node.high[axis][i] >= low) & (node.low[axis][i] <= high) ? -1 : 0;
  }
  for (const HalfSpace& half : region) {
    const float* const x = half.x > 0 ? node.high[0] : node.low[0];
    const float* const y = half.y > 0 ? node.high[1] : node.low[1];
    const float* const z = half.z > 0 ? node.high[2] : node.low[2];
    for (unsigned i = 0; i < width; ++i)
      inside[i] &= half.x * x[i] + half.y * y[i] + half.z * z[i] >= half.limit ? -1 : 0;
  }
  unsigned mask = 0;
  for (unsigned i = 0; i < width; ++i) mask |= inside[i] != 0 ? 1u << i : 0;
  return mask & ((1u << node.count) - 1);
}

bool overlaps(const BoxTree::Node& node, std::uint32_t lane, const ConvexRegion& region) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!(node.high[axis][lane] >= region.low()[axis] && node.low[axis][lane] <= region.high()[axis])) return false;
  for (const HalfSpace& half : region) {
    const float x = half.x > 0 ? node.high[0][lane] : node.low[0][lane];
    const float y = half.y > 0 ? node.high[1][lane] : node.low[1][lane];
    const float z = half.z > 0 ? node.high[2][lane] : node.low[2][lane];
    if (!(half.x * x + half.y * y + half.z * z >= half.limit)) return false;
  }
  return true;
}

}  // namespace tracer
