#pragma once
/// Rounding error bounds, and ray origins that respect them. There is no absolute epsilon anywhere: a ray starts as far
/// from its surface as the hit point may be wrong, and not further.
/// Source: Pharr, Jakob, Humphreys, Physically Based Rendering, 4th ed., sec. 6.8.

#include <cmath>
#include <limits>

#include "tracer/src/math/vec.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// Bound on the relative error of n rounded operations (Higham 2002, sec. 3.1; PBR 4th ed., eq. 6.19), in double.
constexpr double rounding_bound(int n) {
  constexpr double unit = std::numeric_limits<double>::epsilon() * 0.5;
  return (n * unit) / (1 - n * unit);
}

/// A point on a surface and how far, per axis, it may be from it.
struct BoundedPoint {
  Vec3 position;
  Vec3 error;
};

/// `position` moved by `distance` along the unit `normal`, to the side that `direction` goes to, then rounded outwards.
WHITTLE_INLINE Vec3 clear_of(const Vec3& position, const Vec3& normal, double distance, const Vec3& direction) {
  const double side = direction.x * normal.x + direction.y * normal.y + direction.z * normal.z < 0 ? -1.0 : 1.0;
  // An ulp of the result outwards covers the rounding of the sum; |x| 2^-52 is one or two.
  const auto outwards = [](double coordinate, double shift) __attribute__((always_inline)) {
    const double moved = coordinate + shift;
    return moved + std::copysign(std::abs(moved) * 0x1p-52, shift);
  };
  const double step = distance * side;
  return {outwards(position.x, normal.x * step), outwards(position.y, normal.y * step),
          outwards(position.z, normal.z * step)};
}

/// How far along the unit `normal` the box of the point's error reaches.
inline double clearance(const BoundedPoint& point, const Vec3& normal) { return dot(abs(normal), point.error); }

/// Where a ray leaving `point` along `direction` starts: moved along the unit geometric `normal` beyond the box of the
/// point's error (PBR 4th ed., sec. 6.8.6).
inline Vec3 offset_origin(const BoundedPoint& point, const Vec3& normal, const Vec3& direction) {
  return clear_of(point.position, normal, clearance(point, normal), direction);
}

}  // namespace tracer
