#pragma once
/// Convex regions of render space as intersections of half spaces: the rays of a block of pixels, and the segments from
/// a surface to a light. Tests of boxes are conservative: they never reject a box that overlaps the region.

#include <algorithm>
#include <array>
#include <cmath>

#include "tracer/src/math/affine.h"

namespace tracer {

/// Points p with normal.p >= limit.
struct HalfSpace {
  float x = 0, y = 0, z = 0, limit = 0;
};

class ConvexRegion {
 public:
  static constexpr int half_spaces_max = 6;

  /// `reach`: largest |coordinate| of the boxes that are tested.
  explicit ConvexRegion(double reach = 1) : reach_(reach) {}

  /// Cuts the region by the half space behind `point` that `inward` points into. A direction without a length cuts
  /// nothing.
  void cut(const Vec3& inward, const Vec3& point) {
    const Vec3 n = normalize(inward);
    const double offset = dot(n, point), size = dot(abs(n), abs(point));
    // Rounding of the normal and of the sums over a box's coordinates in float (fewer than eight operations, 2^-21),
    // and in double of a point far away from the scene, with room for the rounding of rays from there.
    const double slack = (std::abs(offset) + 2 * reach_) * 0x1p-20 + size * 0x1p-40;
    const double limit = offset - slack;
    if (!(dot(n, n) > 0) || !std::isfinite(limit) || count_ == half_spaces_max) return;
    half_spaces_[static_cast<std::size_t>(count_++)] = {static_cast<float>(n.x), static_cast<float>(n.y),
                                                        static_cast<float>(n.z), static_cast<float>(limit)};
  }

  /// Cuts the region to a box.
  void cut(const Bounds& box) {
    const double slack = reach_ * 0x1p-20;
    const auto cut_axis = [&](std::size_t axis, double low, double high) {
      low_[axis] = std::max(low_[axis], static_cast<float>(low - slack));
      high_[axis] = std::min(high_[axis], static_cast<float>(high + slack));
    };
    cut_axis(0, box.low.x, box.high.x);
    cut_axis(1, box.low.y, box.high.y);
    cut_axis(2, box.low.z, box.high.z);
  }

  [[nodiscard]] const HalfSpace* begin() const { return half_spaces_.data(); }
  [[nodiscard]] const HalfSpace* end() const { return half_spaces_.data() + count_; }
  [[nodiscard]] const std::array<float, 3>& low() const { return low_; }
  [[nodiscard]] const std::array<float, 3>& high() const { return high_; }

 private:
  std::array<HalfSpace, half_spaces_max> half_spaces_;
  int count_ = 0;
  std::array<float, 3> low_{-HUGE_VALF, -HUGE_VALF, -HUGE_VALF}, high_{HUGE_VALF, HUGE_VALF, HUGE_VALF};
  double reach_;
};

/// Region of all segments between two boxes (shaft culling: Haines, Wallace 1991, "Shaft Culling for Efficient Ray-Cast
/// Radiosity"): the box of both, and the planes along one axis that touch an edge of each.
inline ConvexRegion shaft(const Bounds& from, const Bounds& to, double reach) {
  ConvexRegion region(reach);
  Bounds both = from;
  both.include(to.low);
  both.include(to.high);
  region.cut(both);
  const auto corner = [](double low, double high, double side) { return side > 0 ? high : low; };
  // Outward normal across the edges on the sides (a, b) of both boxes in the plane of two axes; valid if it points to
  // those sides.
  const auto cut = [&](double from_a, double from_b, double to_a, double to_b, double a, double b, auto vector) {
    double normal_a = to_b - from_b, normal_b = from_a - to_a;
    if (normal_a * a < 0 || normal_b * b < 0) {
      normal_a = -normal_a;
      normal_b = -normal_b;
    }
    if (normal_a * a < 0 || normal_b * b < 0) return;
    const Vec3 inward = -vector(normal_a, normal_b);
    const Vec3 first = vector(from_a, from_b), second = vector(to_a, to_b);
    region.cut(inward, dot(inward, first) < dot(inward, second) ? first : second);
  };
  for (const double a : {-1.0, 1.0})
    for (const double b : {-1.0, 1.0}) {
      const Vec3 f{corner(from.low.x, from.high.x, a), corner(from.low.y, from.high.y, a),
                   corner(from.low.z, from.high.z, a)};
      const Vec3 g{corner(from.low.x, from.high.x, b), corner(from.low.y, from.high.y, b),
                   corner(from.low.z, from.high.z, b)};
      const Vec3 k{corner(to.low.x, to.high.x, a), corner(to.low.y, to.high.y, a), corner(to.low.z, to.high.z, a)};
      const Vec3 l{corner(to.low.x, to.high.x, b), corner(to.low.y, to.high.y, b), corner(to.low.z, to.high.z, b)};
      cut(f.x, g.y, k.x, l.y, a, b, [](double p, double q) { return Vec3{p, q, 0}; });
      cut(f.y, g.z, k.y, l.z, a, b, [](double p, double q) { return Vec3{0, p, q}; });
      cut(f.z, g.x, k.z, l.x, a, b, [](double p, double q) { return Vec3{q, 0, p}; });
    }
  return region;
}

}  // namespace tracer
