#pragma once
/// Frustum r = radius_0 + (radius_1 - radius_0) z for 0 <= z <= 1, closed by discs where `caps`: cylinders and cones.

#include "tracer/src/shapes/analytic_shape.h"

namespace tracer {

/// A product and its rounding error, which together are exact. std::fma is one instruction, or a library call with the
/// same bits on machines without it.
struct Product {
  double rounded, lost;
};
WHITTLE_INLINE Product product(double a, double b) {
  const double rounded = a * b;
  return {rounded, std::fma(a, b, -rounded)};
}

/// a b - c d with a relative error of two roundings, however much of the products cancels (Kahan; Jeannerod, Louvet,
/// Muller 2013, "Further analysis of Kahan's algorithm for the accurate computation of 2x2 determinants", Math. Comp.
/// 82).
WHITTLE_INLINE double difference_of_products(double a, double b, double c, double d) {
  const Product first = product(a, b), second = product(c, d);
  return (first.rounded - second.rounded) + (first.lost - second.lost);
}

/// Bilinear form x x' + y y' - r r' of the cone, as if computed with twice the digits (Ogita, Rump, Oishi 2005,
/// "Accurate sum and dot product", SIAM J. Sci. Comput. 26(6), algorithm 5.3).
WHITTLE_INLINE double cone_form(const Vec3& v, const Vec3& w) {
  const Product x = product(v.x, w.x), y = product(v.y, w.y), r = product(v.z, w.z);
  const double sum = x.rounded + y.rounded, part = sum - x.rounded;
  const double sum_lost = (x.rounded - (sum - part)) + (y.rounded - part);
  const double whole = sum - r.rounded, rest = whole - sum;
  const double whole_lost = (sum - (whole - rest)) - (r.rounded + rest);
  return whole + ((sum_lost + whole_lost) + ((x.lost + y.lost) - r.lost));
}

/// False only where the ray's line misses the cone's surface by more than any rounding, here or in frustum_hit, can
/// change: by 2^-19 of the distance and by the rounding of the origin. A line that misses the surface misses the solid,
/// ends included. True for a line almost as steep as the surface.
WHITTLE_INLINE bool may_hit_frustum(const ShapeRay& r, double radius_0, double radius_1) {
  const double slope = radius_1 - radius_0;
  const double radius = radius_0 + slope * r.oz, growth = slope * r.dz;
  const double turn = r.ox * r.dy - r.oy * r.dx;
  const double over_x = r.ox * growth - radius * r.dx, over_y = r.oy * growth - radius * r.dy;
  const double across = r.dx * r.dx + r.dy * r.dy;
  const double rounding = (1 + r.ox * r.ox + r.oy * r.oy + r.oz * r.oz) * (across + growth * growth) * 0x1p-54;
  const bool clear = turn * turn > (over_x * over_x + over_y * over_y) * (1 + 0x1p-18) + rounding;
  const bool flatter = across * (1 - 0x1p-10) > growth * growth;
  return !(clear & flatter);
}

/// Solves the cone's equation x^2 + y^2 = (radius_0 + slope z)^2 between its ends; a cylinder has slope 0. Each root is
/// tested separately: where the slope is steeper than the ray, one of them lies on the mirror nappe, beyond the apex. A
/// ray with a distant origin is solved from its point nearest to the shape, so that the discriminant keeps its digits.
///
/// All coefficients vanish for a ray that leaves the side and runs along one of its straight lines: their values are
/// far below the rounding of their terms, so they are summed exactly. With plain sums such rays intersect a side that
/// they pass at a distance of 10^-9, or leave a closed cone without a hit.
template <bool caps>
WHITTLE_INLINE QuadricHit frustum_hit(const ShapeRay& ray, double radius_0, double radius_1) {
  const double middle = ray.oz - 0.5;
  const bool far = ray.ox * ray.ox + ray.oy * ray.oy + middle * middle > 64;
  const double along =
      -(ray.ox * ray.dx + ray.oy * ray.dy + middle * ray.dz) / (ray.dx * ray.dx + ray.dy * ray.dy + ray.dz * ray.dz);
  const double shift = far ? along : 0;
  ShapeRay r = ray;
  r.ox += shift * r.dx;
  r.oy += shift * r.dy;
  r.oz += shift * r.dz;
  const double slope = radius_1 - radius_0;
  const Vec3 o{r.ox, r.oy, radius_0 + slope * r.oz};  // with the side's radius instead of z
  const Vec3 d{r.dx, r.dy, slope * r.dz};
  const double a = cone_form(d, d), b = -cone_form(o, d), c = cone_form(o, o);
  // b^2 - a c by Lagrange's identity for the form: near the apex every term is small, so that no large terms cancel.
  // A line steeper than the cone intersects both nappes, so that rounding must not take its roots away.
  const double turn = difference_of_products(o.x, d.y, o.y, d.x);
  const double over_x = difference_of_products(o.x, d.z, o.z, d.x);
  const double over_y = difference_of_products(o.y, d.z, o.z, d.y);
  const double discriminant = over_x * over_x + over_y * over_y - turn * turn;
  const bool crosses = (discriminant >= 0) | (a < 0);
  const double root = std::sqrt(discriminant > 0 ? discriminant : 0);
  const double q = b >= 0 ? b + root : b - root;
  QuadricHit hit;
  const double slack = caps ? rim_slack : 0;
  const auto consider_side = [&](double t) {
    const double z = r.oz + t * r.dz;
    update_nearest(hit, t + shift, crosses & (z >= -slack) & (z <= 1 + slack), QuadricPart::side);
  };
  consider_side(q / a);
  consider_side(c / q);
  // Caps use the same shifted origin: side and caps then round alike, and the rim has no gap at any distance.
  if (!caps) return hit;
  const auto consider_cap = [&](double end, double cap_radius, QuadricPart part) {
    const double t = (end - r.oz) / r.dz;
    const double x = r.ox + t * r.dx, y = r.oy + t * r.dy;
    const double reach = cap_radius * (1 + rim_slack);
    update_nearest(hit, t + shift, (cap_radius > 0) & (x * x + y * y <= reach * reach), part);
  };
  consider_cap(0, radius_0, QuadricPart::cap_0);
  consider_cap(1, radius_1, QuadricPart::cap_1);
  return hit;
}

struct Frustum : StandardShape {
  static constexpr bool culls = true;

  static Bounds box(const Quadric& q) {
    const double widest = std::max(q.radius_0, q.radius_1);
    return {{-widest, -widest, 0}, {widest, widest, 1}};
  }
  static void include(Bounds& bounds, const Quadric& q) {
    const Linear& m = q.render_from_shape;
    bounds.include(q.origin, disc_extent(m) * q.radius_0);
    bounds.include(q.origin + m * Vec3{0, 0, 1}, disc_extent(m) * q.radius_1);
  }
  static double curvature(const Quadric& q) {
    const Linear& m = q.render_from_shape;
    return 1 / (std::min(length(m.x), length(m.y)) * std::max(q.radius_0, q.radius_1));
  }
  /// Side and caps reach beyond their rim by rim_slack: a ray that leaves one must start clear of the other.
  static double error(const Quadric& q) { return q.caps ? 2 * rim_slack : 0; }

  static WHITTLE_INLINE bool may_hit(const ShapeRay& ray, double radius_0, double radius_1) {
    return may_hit_frustum(ray, radius_0, radius_1);
  }
  template <class Use>
  static WHITTLE_INLINE void with_hit(const Quadric& q, const Use& use) {
    const double radius_0 = q.radius_0, radius_1 = q.radius_1;
    if (q.caps)
      use([=](const ShapeRay& ray)
              __attribute__((always_inline)) { return frustum_hit<true>(ray, radius_0, radius_1); });
    else
      use([=](const ShapeRay& ray)
              __attribute__((always_inline)) { return frustum_hit<false>(ray, radius_0, radius_1); });
  }

  /// The apex has no normal of its own: there it is the axis.
  static WHITTLE_INLINE ShapePoint point(double radius_0, double radius_1, double part, const Vec3& p) {
    const bool cap_0 = part == static_cast<double>(QuadricPart::cap_0);
    const bool cap_1 = part == static_cast<double>(QuadricPart::cap_1), cap = cap_0 | cap_1;
    const double side_z = within_unit(p.z), slope = radius_1 - radius_0, radius = radius_0 + slope * side_z;
    const double r = std::sqrt(p.x * p.x + p.y * p.y);  // no rim is so narrow that a square would vanish
    const bool apex = !((r > 0) & (radius > 0));
    const double x = p.x / r, y = p.y / r, up = slope < 0 ? 1.0 : -1.0;
    const double side_x = apex ? 0 : x * radius, side_y = apex ? 0 : y * radius;
    const double out_x = apex ? 0 : x, out_y = apex ? 0 : y, out_z = apex ? up : -slope;
    const double cap_z = cap_1 ? 1 : 0, cap_out = cap_0 ? -1 : 1;
    return {{cap ? p.x : side_x, cap ? p.y : side_y, cap ? cap_z : side_z},
            {cap ? 0 : out_x, cap ? 0 : out_y, cap ? cap_out : out_z}};
  }
  static Vec2 uv(const Quadric& q, QuadricPart part, const Vec3& p) {
    if (part == QuadricPart::cap_0) return disc_uv(p, q.radius_0);
    if (part == QuadricPart::cap_1) return disc_uv(p, q.radius_1);
    return {turns(p.y, p.x), std::clamp(p.z, 0.0, 1.0)};
  }
  static UvGradients gradients(const Quadric& q, QuadricPart part, const Vec3& p) {
    if (part == QuadricPart::side) return {turn_gradient(p), {0, 0, 1}};
    return disc_gradients(part == QuadricPart::cap_0 ? q.radius_0 : q.radius_1);
  }
};

inline StandardImage<Frustum> standard_image(const Cylinder& c) {
  return {.object_from_standard = round_about(c.from, c.to - c.from, c.u_axis, c.radius), .caps = c.caps};
}
inline StandardImage<Frustum> standard_image(const Cone& c) {
  const double widest = std::max(c.radius, c.apex_radius);
  return {round_about(c.base, c.apex - c.base, c.u_axis, widest), c.radius / widest, c.apex_radius / widest, c.caps};
}

inline double reach(const Cylinder& c) {
  return std::max(largest_component(c.from), largest_component(c.to)) + c.radius;
}
inline double reach(const Cone& c) {
  return std::max(largest_component(c.apex), largest_component(c.base)) + std::max(c.radius, c.apex_radius);
}

template <class Checks>
void check(Checks& checks, const Cylinder& c) {
  if (checks.apart("to", c.to, c.from, "must not be equal to `from`: the cylinder has no length"))
    checks.not_parallel("u_axis", c.u_axis, c.to - c.from, "must not be parallel to the axis");
}
template <class Checks>
void check(Checks& checks, const Cone& c) {
  if (checks.apart("apex", c.apex, c.base, "must not be equal to the base: the cone has no height"))
    checks.not_parallel("u_axis", c.u_axis, c.apex - c.base, "must not be parallel to the axis");
}

}  // namespace tracer
