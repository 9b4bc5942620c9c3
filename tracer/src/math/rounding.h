#pragma once
/// Rounding error bounds, and ray origins that respect them. There is no absolute epsilon: a ray starts exactly as far
/// from its surface as the error bound of the hit point requires.
/// Source: Pharr, Jakob, Humphreys, Physically Based Rendering, 4th ed., sec. 6.8.

#include <cmath>
#include <limits>

#include "tracer/src/math/lanes.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// Bound on the relative error of n rounded operations (Higham 2002, sec. 3.1; PBR 4th ed., eq. 6.19), in double.
constexpr double rounding_bound(int n) {
  constexpr double unit = std::numeric_limits<double>::epsilon() * 0.5;
  return (n * unit) / (1 - n * unit);
}

/// The nearest float at or below `value`, and at or above it.
inline float rounded_down(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded > value ? std::nextafter(rounded, -HUGE_VALF) : rounded;
}
inline float rounded_up(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded < value ? std::nextafter(rounded, HUGE_VALF) : rounded;
}

/// A point on a surface and the bound of its error per axis.
struct BoundedPoint {
  Vec3 position;
  Vec3 error;
};

/// `position` moved by `distance` along the unit `normal`, to the side of `direction`, then rounded outwards.
WHITTLE_INLINE Vec3 clear_of(const Vec3& position, const Vec3& normal, double distance, const Vec3& direction) {
  const double side = direction.x * normal.x + direction.y * normal.y + direction.z * normal.z < 0 ? -1.0 : 1.0;
  // One ulp of the result outwards covers the rounding of the sum; |x| 2^-52 is one or two ulps.
  const auto outwards = [](double coordinate, double shift) __attribute__((always_inline)) {
    const double moved = coordinate + shift;
    return moved + std::copysign(std::abs(moved) * 0x1p-52, shift);
  };
  const double step = distance * side;
  return {outwards(position.x, normal.x * step), outwards(position.y, normal.y * step),
          outwards(position.z, normal.z * step)};
}

/// Extent of the point's error box along the unit `normal`.
inline double clearance(const BoundedPoint& point, const Vec3& normal) { return dot(abs(normal), point.error); }

/// Origin of a ray that leaves `point` along `direction`: moved along the unit geometric `normal` beyond the point's
/// error box (PBR 4th ed., sec. 6.8.6).
inline Vec3 offset_origin(const BoundedPoint& point, const Vec3& normal, const Vec3& direction) {
  return clear_of(point.position, normal, clearance(point, normal), direction);
}

}  // namespace tracer
