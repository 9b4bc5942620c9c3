#include "tracer/src/live/live_bvh.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <span>

#include "tracer/live.h"

namespace tracer {
namespace {

constexpr std::size_t bins = 16;
constexpr std::size_t leaf_primitives = 4;
constexpr float node_cost = 1.2F;  // of the test of two boxes, in tests of a primitive

struct Extent {
  static constexpr float none = std::numeric_limits<float>::infinity();
  std::array<float, 3> low{none, none, none}, high{-none, -none, -none};

  template <class Other>
  void include(const Other& other) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], other.low[axis]);
      high[axis] = std::max(high[axis], other.high[axis]);
    }
  }
  /// Half of the surface.
  [[nodiscard]] float area() const {
    const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    return x >= 0 ? x * y + y * z + z * x : 0;
  }
};

struct Bin {
  Extent box;
  std::size_t count = 0;
};

/// Twice the middle of the box along an axis.
float middle(const LivePrimitive& primitive, std::size_t axis) { return primitive.low[axis] + primitive.high[axis]; }

/// Equal parts of the range of middles along the axis on which it is longest.
struct Bins {
  std::size_t axis = 0;
  float low = 0, scale = 0;  ///< no scale: the range has no extent, or an infinite one

  [[nodiscard]] std::size_t of(const LivePrimitive& primitive) const {
    return std::min(static_cast<std::size_t>((middle(primitive, axis) - low) * scale), bins - 1);
  }
};

Bins bins_of(std::span<const LivePrimitive> range) {
  Extent middles;
  for (const LivePrimitive& primitive : range) {
    const std::array<float, 3> at{middle(primitive, 0), middle(primitive, 1), middle(primitive, 2)};
    middles.include(Extent{at, at});
  }
  Bins best;
  float most = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float extent = middles.high[axis] - middles.low[axis];
    if (!(extent > most)) continue;
    most = extent;
    const float scale = static_cast<float>(bins) / extent;
    best = {axis, middles.low[axis], scale < std::numeric_limits<float>::max() ? scale : 0};
  }
  return best;
}

/// Primitives in the bins up to the returned one go to the left. Sets the cost: the sum over both sides of primitives
/// times half of the surface.
std::size_t best_split(std::span<const LivePrimitive> range, const Bins& by, float& cost) {
  std::array<Bin, bins> row{};
  for (const LivePrimitive& primitive : range) {
    Bin& bin = row[by.of(primitive)];
    bin.box.include(primitive);
    ++bin.count;
  }
  std::array<float, bins> right_cost{};
  Bin right, left;
  for (std::size_t i = bins - 1; i > 0; --i) {
    right.box.include(row[i].box);
    right.count += row[i].count;
    right_cost[i] = right.box.area() * static_cast<float>(right.count);
  }
  std::size_t best = 0;
  cost = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i + 1 < bins; ++i) {
    left.box.include(row[i].box);
    left.count += row[i].count;
    const float here = left.box.area() * static_cast<float>(left.count) + right_cost[i + 1];
    if (here < cost) best = i;
    cost = std::min(cost, here);
  }
  return best;
}

class Builder {
 public:
  explicit Builder(LiveBvh& bvh) : bvh_(bvh) {}

  void build(std::span<LivePrimitive> range, std::uint32_t depth) {
    const std::size_t node = bvh_.nodes.size();
    Extent box;
    for (const LivePrimitive& primitive : range) box.include(primitive);
    for (const auto& corner : {box.low, box.high})
      bvh_.nodes.insert(bvh_.nodes.end(), {corner[0], corner[1], corner[2], 0});
    const std::size_t left = range.size() <= 1 ? 0 : left_part(range, box, depth);
    if (left == 0) {
      const std::size_t first = bvh_.primitives.size() / 4;
      bvh_.nodes[node + 3] = static_cast<float>(first);
      bvh_.nodes[node + 7] = static_cast<float>(range.size());
      for (const LivePrimitive& primitive : range)
        bvh_.primitives.insert(bvh_.primitives.end(), primitive.cell.begin(), primitive.cell.end());
      return;
    }
    build(range.first(left), depth + 1);
    const std::size_t second = bvh_.nodes.size() / 8;
    bvh_.nodes[node + 3] = static_cast<float>(second);
    build(range.subspan(left), depth + 1);
  }

 private:
  /// Partitions the primitives and returns the number of those to the left; 0: they are a leaf.
  std::size_t left_part(std::span<LivePrimitive> range, const Extent& box, std::uint32_t depth) {
    const std::size_t count = range.size();
    const Bins by = bins_of(range);
    const bool must_halve = depth + std::bit_width(count) >= live_bvh_depth_max || by.scale == 0;
    if (must_halve) return count <= leaf_primitives ? 0 : halves(range, by.axis);
    float cost = 0;
    const std::size_t last = best_split(range, by, cost);
    const float leaf_cost = static_cast<float>(count) * box.area();
    if (count <= leaf_primitives && !(cost + node_cost * box.area() < leaf_cost)) return 0;
    const auto end = std::partition(range.begin(), range.end(), [&](const auto& each) { return by.of(each) <= last; });
    const auto left = static_cast<std::size_t>(end - range.begin());
    return left == 0 || left == count ? halves(range, by.axis) : left;
  }

  static std::size_t halves(std::span<LivePrimitive> range, std::size_t axis) {
    const std::size_t half = range.size() / 2;
    std::nth_element(range.begin(), range.begin() + static_cast<std::ptrdiff_t>(half), range.end(),
                     [&](const LivePrimitive& a, const LivePrimitive& b) { return middle(a, axis) < middle(b, axis); });
    return half;
  }

  LiveBvh& bvh_;
};

}  // namespace

LiveBvh build_live_bvh(std::vector<LivePrimitive> primitives) {
  LiveBvh bvh;
  bvh.nodes.reserve(8 * primitives.size());
  bvh.primitives.reserve(4 * primitives.size());
  if (!primitives.empty()) Builder(bvh).build(primitives, 0);
  return bvh;
}

}  // namespace tracer
