#pragma once
/// Unit sphere x^2 + y^2 + z^2 = 1: spheres that a transform made ellipsoids. Other spheres have
/// their own structures (accel/accelerator.h).

#include "tracer/src/shapes/analytic_shape.h"

namespace tracer {

/// u = phi/2pi in [0,1) about z from x towards y, v = 1 - theta/pi. By atan2 throughout: arccos would lose half the
/// digits at the poles. `n` need not be unit; poles have phi = 0.
inline Vec2 spherical_uv(const Vec3& n) {
  return {turns(n.y, n.x), 1 - std::atan2(std::hypot(n.x, n.y), n.z) / std::numbers::pi};
}

/// Gradients of spherical_uv on the unit sphere.
inline UvGradients spherical_gradients(const Vec3& p) {
  const double r = std::hypot(p.x, p.y), scale = std::numbers::pi * dot(p, p);
  return {turn_gradient(p), {-p.z * p.x / (r * scale), -p.z * p.y / (r * scale), r / scale}};
}

struct UnitSphere : StandardShape {
  static Bounds box(const Quadric&) { return {{-1, -1, -1}, {1, 1, 1}}; }
  static void include(Bounds& bounds, const Quadric& q) {
    bounds.include(q.origin, ellipsoid_extent(q.render_from_shape));
  }
  static double curvature(const Quadric& q) {
    const Linear& m = q.render_from_shape;
    return 1 / std::min({length(m.x), length(m.y), length(m.z)});
  }

  /// As in accel/packet.cpp, the discriminant is one minus the squared distance of the line from the center.
  static WHITTLE_INLINE QuadricHit hit(const ShapeRay& r) {
    const double a = r.dx * r.dx + r.dy * r.dy + r.dz * r.dz;
    const double b = -(r.ox * r.dx + r.oy * r.dy + r.oz * r.dz) / a;
    const double lx = r.ox + b * r.dx, ly = r.oy + b * r.dy, lz = r.oz + b * r.dz;
    const double discriminant = (1 - (lx * lx + ly * ly + lz * lz)) / a;
    const double c = (r.ox * r.ox + r.oy * r.oy + r.oz * r.oz - 1) / a;
    const double root = std::sqrt(discriminant > 0 ? discriminant : 0);
    const double q = b >= 0 ? b + root : b - root;
    QuadricHit hit;
    update_nearest(hit, q, discriminant >= 0, QuadricPart::side);
    update_nearest(hit, c / q, discriminant >= 0, QuadricPart::side);
    return hit;
  }
  template <class Use>
  static WHITTLE_INLINE void with_hit(const Quadric&, const Use& use) {
    use([](const ShapeRay& ray) __attribute__((always_inline)) { return hit(ray); });
  }

  static WHITTLE_INLINE ShapePoint point(double, double, double, const Vec3& p) {
    const double size = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
    const double stretch = size > 0 ? size : 1;
    const double x = p.x / stretch, y = p.y / stretch, z = p.z / stretch;
    return {{x, y, z}, {x, y, z}};
  }
  static Vec2 uv(const Quadric&, QuadricPart, const Vec3& p) { return spherical_uv(p); }
  static UvGradients gradients(const Quadric&, QuadricPart, const Vec3& p) { return spherical_gradients(p); }
};

inline StandardImage<UnitSphere> standard_image(const Sphere& sphere) {
  const Axes axes = axes_across(normalize(sphere.axis), sphere.meridian);
  return {{{axes.e0 * sphere.radius, axes.e1 * sphere.radius, axes.n * sphere.radius}, sphere.center}};
}

inline double reach(const Sphere& s) { return largest_component(s.center) + s.radius; }

template <class Checks>
void check(Checks& checks, const Sphere& sphere) {
  checks.not_parallel("meridian", sphere.meridian, sphere.axis,
                      "must not be parallel to the axis: phi = 0 would be undefined");
}

}  // namespace tracer
