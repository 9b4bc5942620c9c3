#pragma once
/// Convex regions of render space as intersections of half spaces: the rays of a block of pixels, and the segments from
/// a surface to a light. Tests of boxes are conservative: they never reject a box that overlaps the region.

#include <array>
#include <cmath>

#include "tracer/src/math/affine.h"

namespace tracer {

class ConvexRegion {
 public:
  /// Cuts the region by the half space behind `point` that `inward` points into. A direction without a length cuts
  /// nothing.
  void cut(const Vec3& inward, const Vec3& point) {
    const Vec3 n = normalize(inward);
    const double limit = dot(n, point), size = dot(abs(n), abs(point));
    if (!(dot(n, n) > 0) || !std::isfinite(limit) || count_ == half_spaces_.size()) return;
    half_spaces_[count_++] = {n, limit - size * rounding};
  }
  /// Cuts the region to a box.
  void cut(const Bounds& box) { box_ = box; }

  [[nodiscard]] bool overlaps(const Bounds& box) const {
    const double slack = std::max(largest_component(box.low), largest_component(box.high)) * rounding;
    if (!box_.empty() &&
        !(box.low.x - slack <= box_.high.x && box.low.y - slack <= box_.high.y && box.low.z - slack <= box_.high.z &&
          box.high.x + slack >= box_.low.x && box.high.y + slack >= box_.low.y && box.high.z + slack >= box_.low.z))
      return false;
    for (std::size_t i = 0; i < count_; ++i) {
      const auto& [n, limit] = half_spaces_[i];
      const Vec3 corner{n.x > 0 ? box.high.x : box.low.x, n.y > 0 ? box.high.y : box.low.y,
                        n.z > 0 ? box.high.z : box.low.z};
      if (!(dot(n, corner) >= limit - slack)) return false;
    }
    return true;
  }

 private:
  /// Bounds the rounding of normals, of sums over three coordinates and of rays from points far away from the scene.
  static constexpr double rounding = 0x1p-36;
  /// Points p with normal.p >= limit.
  struct HalfSpace {
    Vec3 normal;
    double limit;
  };
  std::array<HalfSpace, 6> half_spaces_;
  std::size_t count_ = 0;
  Bounds box_;  ///< empty: none
};

/// Region of all segments between two boxes (shaft culling: Haines, Wallace 1991, "Shaft Culling for Efficient Ray-Cast
/// Radiosity"): the box of both, and the planes along one axis that touch an edge of each.
inline ConvexRegion shaft(const Bounds& from, const Bounds& to) {
  ConvexRegion region;
  Bounds both = from;
  both.include(to);
  region.cut(both);
  using Axis = double Vec3::*;
  constexpr std::array<std::array<Axis, 2>, 3> planes{
      {{&Vec3::x, &Vec3::y}, {&Vec3::y, &Vec3::z}, {&Vec3::z, &Vec3::x}}};
  for (const auto& [p, q] : planes)
    for (const bool high_p : {false, true})
      for (const bool high_q : {false, true}) {
        const auto edge = [&, p = p, q = q](const Bounds& box) {
          Vec3 corner{};
          corner.*p = (high_p ? box.high : box.low).*p;
          corner.*q = (high_q ? box.high : box.low).*q;
          return corner;
        };
        // Outward normal across the edges on these sides of both boxes; valid if it points to the sides.
        const Vec3 first = edge(from), second = edge(to);
        Vec3 inward{};
        inward.*p = first.*q - second.*q;
        inward.*q = second.*p - first.*p;
        const auto points_in = [&, p = p, q = q] {
          return (high_p ? inward.*p <= 0 : inward.*p >= 0) && (high_q ? inward.*q <= 0 : inward.*q >= 0);
        };
        if (!points_in()) inward = -inward;
        if (points_in()) region.cut(inward, dot(inward, first) < dot(inward, second) ? first : second);
      }
  return region;
}

}  // namespace tracer
