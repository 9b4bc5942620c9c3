#pragma once
/// Arithmetic of points, directions and colors, in double (math/rounding.h gives the error bounds).

#include <algorithm>
#include <cmath>

#include "tracer/scene.h"

namespace tracer {

inline Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
inline Vec3 operator*(const Vec3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vec3 operator*(double s, const Vec3& a) { return a * s; }
inline Vec3 operator/(const Vec3& a, double s) { return {a.x / s, a.y / s, a.z / s}; }
inline Vec3& operator+=(Vec3& a, const Vec3& b) { return a = a + b; }

inline double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline Vec3 abs(const Vec3& a) { return {std::abs(a.x), std::abs(a.y), std::abs(a.z)}; }
inline double max_component(const Vec3& a) { return std::max({a.x, a.y, a.z}); }
inline bool finite(const Vec3& a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }

/// `a` at unit length. Divides by the largest component's power of two first, so that no square overflows or
/// underflows: exact under scaling by powers of two. The zero vector stays zero.
inline Vec3 normalize(const Vec3& a) {
  const double largest = max_component(abs(a));
  if (largest > 0x1p-400 && largest < 0x1p400)
    return a / length(a);  // bit-identical: no square overflows or underflows
  if (!(largest > 0)) return {};
  const Vec3 scaled = a * std::ldexp(1.0, -std::ilogb(largest));
  return scaled / length(scaled);
}

/// The same for vectors with a length close to one: no range check, and several times faster.
inline Vec3 unit(const Vec3& a) { return a * (1 / length(a)); }

inline Color operator+(const Color& a, const Color& b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
inline Color operator*(const Color& a, const Color& b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
inline Color operator*(const Color& a, double s) { return {a.r * s, a.g * s, a.b * s}; }
inline Color operator*(double s, const Color& a) { return a * s; }
inline Color& operator+=(Color& a, const Color& b) { return a = a + b; }
inline double max_component(const Color& a) { return std::max({a.r, a.g, a.b}); }
/// Branch-free, so that loops over lanes vectorize.
inline bool is_black(const Color& a) { return (a.r == 0) & (a.g == 0) & (a.b == 0); }
/// True if all components are finite: x - x is 0 except for infinities and NaN. Branch-free, because it runs once per
/// sample.
inline bool finite(const Color& a) { return (a.r - a.r) + (a.g - a.g) + (a.b - a.b) == 0; }

/// Right-handed axes with `n` unit: e1 = n x e0.
struct Axes {
  Vec3 e0, e1, n;
};

/// Any axes about unit `n` (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
inline Axes axes_about(const Vec3& n) {
  const double sign = std::copysign(1.0, n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
  return {{1 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

/// e0 is `first` projected across unit `n`; if that vanishes the world's z axis is used, and if `n` is along z too, x.
inline Axes axes_across(const Vec3& n, const Vec3& first) {
  Vec3 across{};
  for (const Vec3& candidate : {normalize(first), Vec3{0, 0, 1}, Vec3{1, 0, 0}}) {
    across = candidate - n * dot(candidate, n);
    // Nearly parallel, within a thousand times the rounding error of the projection: the direction would be noise.
    if (dot(across, across) > 1e-26) break;
  }
  // Projected again, because normalization amplifies the residual component along n.
  const Vec3 once = normalize(across);
  const Vec3 e0 = normalize(once - n * dot(once, n));
  return {e0, cross(n, e0), n};
}

}  // namespace tracer
