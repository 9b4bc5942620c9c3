#pragma once
/// Unit cube 0 <= x, y, z <= 1.

#include "tracer/src/shapes/analytic_shape.h"

namespace tracer {

/// Slabs (Kay & Kajiya 1986). The order of the comparisons drops the 0/0 of a ray within a face's plane.
WHITTLE_INLINE QuadricHit unit_cube_hit(const ShapeRay& r) {
  double enter = -std::numeric_limits<double>::infinity(), leave = std::numeric_limits<double>::infinity();
  double enter_part = 0, leave_part = 0;
  const auto slab = [&](double o, double d, QuadricPart low, QuadricPart high) {
    // If d is 0 the quotients are infinities with the signs that leave the slab unbounded (within it) or empty
    // (outside), once -0 is replaced by 0.
    const double step = d + 0.0;
    const double t0 = -o / step, t1 = (1 - o) / step;
    const bool forward = step >= 0;
    const double near = forward ? t0 : t1, far = forward ? t1 : t0;
    const double near_part = static_cast<double>(forward ? low : high);
    const double far_part = static_cast<double>(forward ? high : low);
    const bool later = near > enter;
    enter = later ? near : enter;
    enter_part = later ? near_part : enter_part;
    const bool sooner = far < leave;
    leave = sooner ? far : leave;
    leave_part = sooner ? far_part : leave_part;
  };
  slab(r.ox, r.dx, QuadricPart::x_0, QuadricPart::x_1);
  slab(r.oy, r.dy, QuadricPart::y_0, QuadricPart::y_1);
  slab(r.oz, r.dz, QuadricPart::z_0, QuadricPart::z_1);
  QuadricHit hit;
  const bool crosses = (enter <= leave) & (leave > 0);
  const bool outside = enter > 0;
  hit.t = crosses ? (outside ? enter : leave) : hit.t;
  hit.part = outside ? enter_part : leave_part;
  return hit;
}

/// One coordinate of the point of the cube next to p; `out` is the component of the normal: 1 or -1 across a face, else
/// 0.
WHITTLE_INLINE double cube_coordinate(double out, double p) {
  const double inside = within_unit(p), side = out < 0 ? 0 : 1;
  return out == 0 ? inside : side;
}

/// One component of the normal of a part, by the two faces across its axis.
WHITTLE_INLINE double cube_normal(double part, QuadricPart at_0, QuadricPart at_1) {
  return (part == static_cast<double>(at_1) ? 1.0 : 0.0) - (part == static_cast<double>(at_0) ? 1.0 : 0.0);
}

struct UnitCube : StandardShape {
  static Bounds box(const Quadric&) { return {{0, 0, 0}, {1, 1, 1}}; }
  static void include(Bounds& bounds, const Quadric& q) {
    const Linear& m = q.render_from_shape;
    bounds.include(q.origin + m * Vec3{0.5, 0.5, 0.5}, (abs(m.x) + abs(m.y) + abs(m.z)) * 0.5);
  }
  template <class Use>
  static WHITTLE_INLINE void with_hit(const Quadric&, const Use& use) {
    use([](const ShapeRay& ray) __attribute__((always_inline)) { return unit_cube_hit(ray); });
  }

  static WHITTLE_INLINE ShapePoint point(double, double, double part, const Vec3& p) {
    const double x = cube_normal(part, QuadricPart::x_0, QuadricPart::x_1);
    const double y = cube_normal(part, QuadricPart::y_0, QuadricPart::y_1);
    const double z = cube_normal(part, QuadricPart::z_0, QuadricPart::z_1);
    return {{cube_coordinate(x, p.x), cube_coordinate(y, p.y), cube_coordinate(z, p.z)}, {x, y, z}};
  }
  /// A face from outside: u to the right, v up, where up is y (and away from the viewer on the top face).
  static UvGradients gradients(const Quadric&, QuadricPart part, const Vec3&) {
    constexpr Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, minus_x{-1, 0, 0}, minus_z{0, 0, -1};
    constexpr UvGradients faces[] = {{z, y}, {minus_z, y}, {x, z}, {x, minus_z}, {minus_x, y}, {x, y}};
    return faces[static_cast<int>(part) - static_cast<int>(QuadricPart::x_0)];
  }
  static Vec2 uv(const Quadric& q, QuadricPart part, const Vec3& p) {
    const auto [u, v] = gradients(q, part, p);
    const auto coordinate = [&](const Vec3& axis) { return dot(axis, p) + (axis.x + axis.y + axis.z < 0 ? 1 : 0); };
    return {coordinate(u), coordinate(v)};
  }
};

inline StandardImage<UnitCube> standard_image(const Box& box) {
  const Vec3 size = box.max - box.min;
  return {{{{size.x, 0, 0}, {0, size.y, 0}, {0, 0, size.z}}, box.min}};
}

inline double reach(const Box& b) { return std::max(largest_component(b.min), largest_component(b.max)); }

template <class Checks>
void check(Checks& checks, const Box& box) {
  checks.all_greater("max", box.max, box.min, "every coordinate must be greater than that of `min`");
}

}  // namespace tracer
