#pragma once
/// Bounding volume hierarchy over the boxes of all primitives except planes, for convex regions instead of rays.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/control.h"
#include "tracer/src/accel/accelerator.h"
#include "tracer/src/certify/convex_region.h"

namespace tracer {

class BoxTree {
 public:
  /// Incomplete after cancellation. Throws std::bad_alloc.
  BoxTree(const GeometrySet& geometry, const RenderControl& control);

  /// Calls use(primitive) for those whose boxes may overlap the region, until it returns false.
  template <class Use>
  void each(const ConvexRegion& region, const Use& use) const {
    for (std::size_t i = 0; i < nodes_.size();) {
      const Node& node = nodes_[i];
      const bool overlaps = region.overlaps(node.box);
      if (overlaps && node.primitive.hit() && !use(node.primitive)) return;
      i = overlaps ? i + 1 : node.next;
    }
  }
  /// Largest |coordinate| of the boxes.
  [[nodiscard]] double reach() const { return reach_; }

 private:
  /// In depth-first order; a leaf is one primitive.
  struct Node {
    Bounds box;
    PrimitiveRef primitive{};
    std::uint32_t next = 0;  ///< first node that is not below this one
  };
  void build(std::span<Node> leaves, const RenderControl& control);

  std::vector<Node> nodes_;
  double reach_ = 0;
};

}  // namespace tracer
