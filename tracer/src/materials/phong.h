#pragma once
/// Specular terms of the local illumination models.

#include <cmath>

#include "tracer/src/math/vec.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// Base of the specular power (math/power.h) at unit normal n, unit directions l to the light and v to the eye, n.l >
/// 0; not clamped. phong: r.v with r = 2(n.l)n - l (Phong 1975). blinn_phong: n.h with h = (l+v)/|l+v| (Blinn 1977), 0
/// if l = -v.
WHITTLE_INLINE double phong_cosine(const Vec3& n, const Vec3& l, const Vec3& v) {
  const double twice = 2 * (n.x * l.x + n.y * l.y + n.z * l.z);
  return (n.x * twice - l.x) * v.x + (n.y * twice - l.y) * v.y + (n.z * twice - l.z) * v.z;
}
WHITTLE_INLINE double blinn_cosine(const Vec3& n, const Vec3& l, const Vec3& v) {
  const double x = l.x + v.x, y = l.y + v.y, z = l.z + v.z;
  const double length = std::sqrt(x * x + y * y + z * z);
  const double cosine = (n.x * x + n.y * y + n.z * z) / length;
  return length > 0 ? cosine : 0;
}

}  // namespace tracer
