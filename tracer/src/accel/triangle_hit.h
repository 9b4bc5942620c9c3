#pragma once
/// Where a ray meets a triangle of doubles, decided so that no ray slips between triangles that share an edge or a
/// vertex: Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1). Branch-free.
///
/// Why nothing leaks: (1) the plane across the ray into which a vertex is projected depends on the ray and on that
/// vertex only, so triangles that share a vertex see it at the same, if rounded, place. (2) An edge's function a*b -
/// c*d has, rounded, the sign of the exact one or is zero: rounding is monotonous, so a*b > c*d never becomes <, and
/// contraction, which would spoil it, is off. From the other side the same edge gives exactly its negative. (3)
/// Comparisons are closed: zero belongs to both sides. So of the triangles around an edge or a vertex at least one is
/// met. Their method takes ties to a higher precision to choose one; here both are hits and the lowest wins.

#include <limits>

#include "tracer/src/accel/geometry.h"
#include "tracer/src/accel/inline.h"

namespace tracer {

/// `t` is NaN, which is nearer than nothing, where there is no hit.
struct TriangleHit {
  double t = std::numeric_limits<double>::quiet_NaN();
  double u = 0, v = 0;  ///< weights of the second and third vertex
};

struct TriangleTest {
  Vec3 a, b, c;
};

inline TriangleTest triangle_test(const TriangleGeometry& geometry, std::uint32_t primitive) {
  const auto& [a, b, c] = geometry.triangles[primitive];
  return {geometry.position(a), geometry.position(b), geometry.position(c)};
}

/// A vertex as the ray sees it: across it in x and y, along it in z, each times the ray's largest component.
struct SeenVertex {
  double x, y, z;
};

/// Swaps the ray's largest component into z: projecting along it loses no digits. Which axes are swapped decides no
/// hit, since both sides of a triangle count. Instead of shearing by d.x / d.z all is multiplied by d.z: no division.
struct SeenAlong {
  double ox, oy, oz, dx, dy, dz;
  bool x_leads, y_leads;
};

WHITTLE_INLINE SeenAlong seen_along(double ox, double oy, double oz, double dx, double dy, double dz) {
  const double ax = std::abs(dx), ay = std::abs(dy), az = std::abs(dz);
  const bool x_leads = (ax >= ay) & (ax > az);
  const bool y_leads = !x_leads & (ay > az);
  return {ox, oy, oz, x_leads ? dz : dx, y_leads ? dz : dy, x_leads ? dx : (y_leads ? dy : dz), x_leads, y_leads};
}

WHITTLE_INLINE SeenVertex seen(const SeenAlong& ray, const Vec3& vertex) {
  const double x = vertex.x - ray.ox, y = vertex.y - ray.oy, z = vertex.z - ray.oz;
  const double across_x = ray.x_leads ? z : x, across_y = ray.y_leads ? z : y;
  const double along = ray.x_leads ? x : (ray.y_leads ? y : z);
  return {across_x * ray.dz - along * ray.dx, across_y * ray.dz - along * ray.dy, along};
}

WHITTLE_INLINE TriangleHit watertight_hit(const TriangleTest& triangle, const SeenAlong& ray) {
  const SeenVertex a = seen(ray, triangle.a), b = seen(ray, triangle.b), c = seen(ray, triangle.c);
  const double at_a = c.x * b.y - c.y * b.x;
  const double at_b = a.x * c.y - a.y * c.x;
  const double at_c = b.x * a.y - b.y * a.x;
  const bool inside = ((at_a >= 0) & (at_b >= 0) & (at_c >= 0)) | ((at_a <= 0) & (at_b <= 0) & (at_c <= 0));
  const double whole = at_a + at_b + at_c;  // of one sign: nothing cancels, and it is zero only edge-on
  const double share = 1 / whole;
  const double u = at_b * share, v = at_c * share;
  const double t = (at_a * share * a.z + u * b.z + v * c.z) / ray.dz;  // a mean: never outside the triangle's depths
  TriangleHit hit;
  hit.t = inside & (whole != 0) & (t > 0) & (t <= std::numeric_limits<double>::max()) ? t : hit.t;
  hit.u = u < 1 ? u : 1;
  hit.v = v < 1 - hit.u ? v : 1 - hit.u;
  return hit;
}

}  // namespace tracer
