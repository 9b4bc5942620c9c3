#pragma once
/// Axis-parallel boxes.

#include "tracer/src/math/affine.h"

namespace tracer {

struct Bounds {
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL};
  Vec3 high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  void include(const Vec3& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  /// Box from center - extent to center + extent.
  void include(const Vec3& center, const Vec3& extent) {
    include(center - extent);
    include(center + extent);
  }
  [[nodiscard]] bool empty() const { return !(low.x <= high.x); }
};

/// Magnitude of the largest component.
inline double largest_component(const Vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

}  // namespace tracer
