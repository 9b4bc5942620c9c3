#pragma once
/// Linear and affine maps in double, and axis-parallel boxes. Names of maps are target from source: world_from_object *
/// object_from_shape.

#include "tracer/src/math/vec.h"

namespace tracer {

/// 3x3, by columns: the images of the axes.
struct Linear {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  bool operator==(const Linear&) const = default;
};

inline Vec3 operator*(const Linear& m, const Vec3& v) { return m.x * v.x + m.y * v.y + m.z * v.z; }
inline Linear operator*(const Linear& a, const Linear& b) { return {a * b.x, a * b.y, a * b.z}; }
inline Linear transposed(const Linear& m) {
  return {{m.x.x, m.y.x, m.z.x}, {m.x.y, m.y.y, m.z.y}, {m.x.z, m.y.z, m.z.z}};
}
inline double determinant(const Linear& m) { return dot(m.x, cross(m.y, m.z)); }

/// By cofactors: the rows of the inverse are the cross products of the columns over the determinant. Precondition: not
/// singular.
inline Linear inverse(const Linear& m) {
  const double d = determinant(m);
  return transposed({cross(m.y, m.z) / d, cross(m.z, m.x) / d, cross(m.x, m.y) / d});
}

/// True if the columns span less than 2^-48 of the product of their lengths: rounding has made the map singular, and
/// its inverse is meaningless.
inline bool is_singular(const Linear& m) {
  return !(std::abs(determinant({normalize(m.x), normalize(m.y), normalize(m.z)})) > 0x1p-48);
}

/// p -> linear p + offset.
struct Affine {
  Linear linear;
  Vec3 offset{};

  [[nodiscard]] Vec3 point(const Vec3& p) const { return linear * p + offset; }
  [[nodiscard]] Vec3 direction(const Vec3& d) const { return linear * d; }
};

inline Affine operator*(const Affine& a, const Affine& b) { return {a.linear * b.linear, a.point(b.offset)}; }

/// Transforms a normal by the inverse transpose; the sign of the determinant keeps its side under reflections. The
/// result is not unit length.
inline Vec3 transformed_normal(const Linear& target_from_source, const Vec3& n) {
  const Linear& m = target_from_source;
  // The cofactor matrix: inverse transpose times determinant, without dividing.
  const Vec3 image = cross(m.y, m.z) * n.x + cross(m.z, m.x) * n.y + cross(m.x, m.y) * n.z;
  return determinant(m) < 0 ? -image : image;
}

/// Axis-parallel box.
struct Bounds {
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL};
  Vec3 high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  void include(const Vec3& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  void include(const Bounds& other) {
    include(other.low);
    include(other.high);
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
