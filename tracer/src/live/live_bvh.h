#pragma once
/// Bounding volume hierarchy of the live form, whose nodes a shader reads in order.

#include <array>
#include <vector>

namespace tracer {

struct LivePrimitive {
  std::array<float, 3> low, high;  ///< its box
  std::array<float, 4> cell;       ///< as in LiveScene::primitives
};

struct LiveBvh {
  std::vector<float> nodes, primitives;  ///< as in LiveScene
};

/// Splits by the surface area heuristic over 16 bins (Wald 2007, "On fast Construction of SAH-based Bounding Volume
/// Hierarchies"), and by halves where the tree would exceed live_bvh_depth_max otherwise. Without primitives there are
/// no nodes. Precondition: boxes are finite, and there are less than 2^24 primitives.
LiveBvh build_live_bvh(std::vector<LivePrimitive> primitives);

}  // namespace tracer
