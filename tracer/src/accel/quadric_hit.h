#pragma once
/// Where a ray meets a standard shape: branch-free, so that a loop over a packet's lanes becomes vector code.

#include <cmath>
#include <limits>

#include "tracer/src/accel/quadric.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// Nearest hit at a distance > 0; `t` is infinite when there is none.
struct QuadricHit {
  double t = std::numeric_limits<double>::infinity();
  double part = 0;  ///< a QuadricPart, in the lanes' own type
};

/// A ray in the shape's space, d not unit.
struct ShapeRay {
  double ox, oy, oz, dx, dy, dz;
};

WHITTLE_INLINE void consider(QuadricHit& best, double t, bool valid, QuadricPart part) {
  const bool nearer = valid & (t > 0) & (t < best.t);
  best.t = nearer ? t : best.t;
  best.part = nearer ? static_cast<double>(part) : best.part;
}

WHITTLE_INLINE ShapeRay shape_ray(const Quadric& q, double ox, double oy, double oz, double dx, double dy, double dz) {
  const Linear& m = q.shape_from_trace;
  const double fx = ox - q.origin.x, fy = oy - q.origin.y, fz = oz - q.origin.z;
  return {m.x.x * fx + m.y.x * fy + m.z.x * fz, m.x.y * fx + m.y.y * fy + m.z.y * fz,
          m.x.z * fx + m.y.z * fy + m.z.z * fz, m.x.x * dx + m.y.x * dy + m.z.x * dz,
          m.x.y * dx + m.y.y * dy + m.z.y * dz, m.x.z * dx + m.y.z * dy + m.z.z * dz};
}

/// As the sphere's: the discriminant is one minus the squared distance of the line from the centre.
WHITTLE_INLINE QuadricHit ellipsoid_hit(const ShapeRay& r) {
  const double a = r.dx * r.dx + r.dy * r.dy + r.dz * r.dz;
  const double b = -(r.ox * r.dx + r.oy * r.dy + r.oz * r.dz) / a;
  const double lx = r.ox + b * r.dx, ly = r.oy + b * r.dy, lz = r.oz + b * r.dz;
  const double discriminant = (1 - (lx * lx + ly * ly + lz * lz)) / a;
  const double c = (r.ox * r.ox + r.oy * r.oy + r.oz * r.oz - 1) / a;
  const double root = std::sqrt(discriminant > 0 ? discriminant : 0);
  const double q = b >= 0 ? b + root : b - root;
  QuadricHit hit;
  consider(hit, q, discriminant >= 0, QuadricPart::side);
  consider(hit, c / q, discriminant >= 0, QuadricPart::side);
  return hit;
}

/// A product, and what its rounding lost: together they are exact. One instruction where the machine has it, a call of
/// the library to the same bits where it has not.
struct Product {
  double rounded, lost;
};
WHITTLE_INLINE Product product(double a, double b) {
  const double rounded = a * b;
  return {rounded, std::fma(a, b, -rounded)};
}

/// a b - c d, right to two roundings of itself however much of the products cancels (Kahan's; Jeannerod, Louvet, Muller
/// 2013, "Further analysis of Kahan's algorithm for the accurate computation of 2x2 determinants", Math. Comp. 82).
WHITTLE_INLINE double difference_of_products(double a, double b, double c, double d) {
  const Product first = product(a, b), second = product(c, d);
  return (first.rounded - second.rounded) + (first.lost - second.lost);
}

/// The cone's form x x' + y y' - r r' of two vectors, as if in twice the digits (Ogita, Rump, Oishi 2005, "Accurate sum
/// and dot product", SIAM J. Sci. Comput. 26(6), algorithm 5.3).
WHITTLE_INLINE double cone_form(const Vec3& v, const Vec3& w) {
  const Product x = product(v.x, w.x), y = product(v.y, w.y), r = product(v.z, w.z);
  const double sum = x.rounded + y.rounded, part = sum - x.rounded;
  const double sum_lost = (x.rounded - (sum - part)) + (y.rounded - part);
  const double whole = sum - r.rounded, rest = whole - sum;
  const double whole_lost = (sum - (whole - rest)) - (r.rounded + rest);
  return whole + ((sum_lost + whole_lost) + ((x.lost + y.lost) - r.lost));
}

/// False only where the ray's line passes the cone's surface by so much that no rounding, of this or of frustum_hit,
/// makes them meet: by 2^-19 of the distance, and by the rounding of where the ray starts. A line that misses the
/// surface misses what it encloses, ends included. A line almost as steep as the surface is not judged.
WHITTLE_INLINE bool may_meet_frustum(const ShapeRay& r, double radius_0, double radius_1) {
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

/// The cone's equation x^2 + y^2 = (radius_0 + slope z)^2 between its ends; a cylinder has slope 0. Each root is tested
/// by itself: where the slope is steeper than the ray, one of them lies on the mirror nappe, beyond the apex. A ray
/// that starts far off is solved from its nearest point to the shape, or the discriminant would drown in the distance.
///
/// All coefficients vanish for a ray that starts beside the side, as one that has just left it does, and runs along one
/// of its straight lines: what is left of them is far below the rounding of their terms, so they are summed exactly.
/// Plain sums let such rays meet the side that they run 10^-9 beside, or leave a closed cone unseen.
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
  // b^2 - a c by Lagrange's identity for the form: near the apex all of it is small, and nothing that is large cancels.
  // A line steeper than the cone meets both nappes, so that rounding must not take its roots away.
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
    consider(hit, t + shift, crosses & (z >= -slack) & (z <= 1 + slack), QuadricPart::side);
  };
  consider_side(q / a);
  consider_side(c / q);
  // From the same shifted origin: side and caps then round alike, and the rim has no gap however far the ray comes
  // from.
  if (!caps) return hit;
  const auto consider_cap = [&](double end, double cap_radius, QuadricPart part) {
    const double t = (end - r.oz) / r.dz;
    const double x = r.ox + t * r.dx, y = r.oy + t * r.dy;
    const double reach = cap_radius * (1 + rim_slack);
    consider(hit, t + shift, (cap_radius > 0) & (x * x + y * y <= reach * reach), part);
  };
  consider_cap(0, radius_0, QuadricPart::cap_0);
  consider_cap(1, radius_1, QuadricPart::cap_1);
  return hit;
}

WHITTLE_INLINE QuadricHit disc_hit(const ShapeRay& r, double inner) {
  QuadricHit hit;
  const double t = -r.oz / r.dz;
  const double x = r.ox + t * r.dx, y = r.oy + t * r.dy;
  const double squared = x * x + y * y;
  consider(hit, t, (squared <= 1) & (squared >= inner * inner), QuadricPart::cap_1);
  return hit;
}

/// Slabs (Kay & Kajiya 1986). The order of the comparisons drops the 0/0 of a ray within a face's plane.
WHITTLE_INLINE QuadricHit box_hit(const ShapeRay& r) {
  double enter = -std::numeric_limits<double>::infinity(), leave = std::numeric_limits<double>::infinity();
  double enter_part = 0, leave_part = 0;
  const auto slab = [&](double o, double d, QuadricPart low, QuadricPart high) {
    // Along the face's plane d is nothing: the quotients are infinities of the signs that leave the slab unbounded
    // (within it) or empty (outside), once -0 is no more.
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
  const bool met = (enter <= leave) & (leave > 0);
  const bool outside = enter > 0;
  hit.t = met ? (outside ? enter : leave) : hit.t;
  hit.part = outside ? enter_part : leave_part;
  return hit;
}

WHITTLE_INLINE QuadricHit quadric_hit(const Quadric& q, const ShapeRay& ray) {
  switch (q.kind) {
    case QuadricKind::ellipsoid:
      return ellipsoid_hit(ray);
    case QuadricKind::disc:
      return disc_hit(ray, q.radius_0);
    case QuadricKind::frustum:
      return q.caps ? frustum_hit<true>(ray, q.radius_0, q.radius_1) : frustum_hit<false>(ray, q.radius_0, q.radius_1);
    case QuadricKind::box:
      return box_hit(ray);
  }
  return {};
}

}  // namespace tracer
