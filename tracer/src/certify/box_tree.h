#pragma once
/// Bounding volume hierarchy over the boxes of all primitives except planes, for convex regions instead of rays. Eight
/// boxes a node: a test of a node is a loop over eight lanes.

#include <cstdint>
#include <vector>

#include "tracer/control.h"
#include "tracer/src/accel/accelerator.h"
#include "tracer/src/certify/convex_region.h"

namespace tracer {

/// Box of a primitive, or of the points that a ray may report as its hit. Empty for a plane.
Bounds bounds_of(const GeometrySet& geometry, const PrimitiveRef& primitive);

class BoxTree {
 public:
  static constexpr unsigned width = 8;

  /// Boxes of up to eight children: primitives, or other nodes. Lanes from `count` on overlap nothing.
  struct alignas(32) Node {
    float low[3][width], high[3][width];
    std::uint32_t child[width];  ///< number of a primitive or a node
    std::uint32_t count = 0;
    bool leaf = true;  ///< the children are primitives
  };

  /// Incomplete after cancellation. Throws std::bad_alloc.
  BoxTree(const GeometrySet& geometry, const RenderControl& control);

  [[nodiscard]] bool empty() const { return nodes_.empty(); }
  /// Node 0 is the root, unless the tree is empty.
  [[nodiscard]] const Node& node(std::uint32_t number) const { return nodes_[number]; }
  [[nodiscard]] PrimitiveRef primitive(std::uint32_t number) const { return primitives_[number]; }
  /// Largest |coordinate| of the boxes.
  [[nodiscard]] double reach() const { return reach_; }

 private:
  struct Item {
    float low[3], high[3];
    std::uint32_t number;
  };
  std::uint32_t build(Item* first, Item* last, const RenderControl& control);
  void set_child(std::uint32_t node, std::uint32_t child, const Item* first, const Item* last);

  std::vector<PrimitiveRef> primitives_;
  std::vector<Item> items_;  ///< empty after construction
  std::vector<Node> nodes_;
  double reach_ = 0;
};

/// Children of the node whose boxes may overlap the region, as bits.
unsigned overlaps(const BoxTree::Node& node, const ConvexRegion& region);
/// The same for one child.
bool overlaps(const BoxTree::Node& node, std::uint32_t lane, const ConvexRegion& region);

}  // namespace tracer
