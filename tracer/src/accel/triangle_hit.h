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

#include "tracer/src/accel/dominant_axis.h"
#include "tracer/src/accel/geometry.h"
#include "tracer/src/math/wide.h"

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
struct ShearedVertex {
  double x, y, z;
};

/// Swaps the ray's largest component into z: projecting along it loses no digits. Which axes are swapped decides no
/// hit, since both sides of a triangle count. Instead of shearing by d.x / d.z all is multiplied by d.z: no division.
struct RayShear {
  double ox, oy, oz, dx, dy, dz;
  bool along_x, along_y;
};

WHITTLE_INLINE RayShear seen_along(double ox, double oy, double oz, double dx, double dy, double dz, bool along_x,
                                   bool along_y) {
  return {ox, oy, oz, along_x ? dz : dx, along_y ? dz : dy, along_x ? dx : (along_y ? dy : dz), along_x, along_y};
}

WHITTLE_INLINE RayShear seen_along(double ox, double oy, double oz, double dx, double dy, double dz) {
  const bool along_x = x_is_dominant(dx, dy, dz);
  return seen_along(ox, oy, oz, dx, dy, dz, along_x, !along_x & y_leads(dy, dz));
}

WHITTLE_INLINE ShearedVertex seen(const RayShear& ray, const Vec3& vertex) {
  const double x = vertex.x - ray.ox, y = vertex.y - ray.oy, z = vertex.z - ray.oz;
  const double across_x = ray.along_x ? z : x, across_y = ray.along_y ? z : y;
  const double along = ray.along_x ? x : (ray.along_y ? y : z);
  return {across_x * ray.dz - along * ray.dx, across_y * ray.dz - along * ray.dy, along};
}

/// What the edges say: each function is the share, of their sum, of the vertex across it.
struct ShearedTriangle {
  double at_a, at_b, at_c;
  double depth_a, depth_b, depth_c;
  bool inside;
};

WHITTLE_INLINE double edge(const ShearedVertex& from, const ShearedVertex& to) { return to.x * from.y - to.y * from.x; }

WHITTLE_INLINE ShearedTriangle seen(const RayShear& ray, const TriangleTest& triangle) {
  const ShearedVertex a = seen(ray, triangle.a), b = seen(ray, triangle.b), c = seen(ray, triangle.c);
  const double at_a = edge(b, c), at_b = edge(c, a), at_c = edge(a, b);
  const bool inside = ((at_a >= 0) & (at_b >= 0) & (at_c >= 0)) | ((at_a <= 0) & (at_b <= 0) & (at_c <= 0));
  return {at_a, at_b, at_c, a.z, b.z, c.z, inside};
}

/// `dz` is the ray's largest component.
WHITTLE_INLINE TriangleHit watertight_hit(const ShearedTriangle& s, double dz) {
  const double whole = s.at_a + s.at_b + s.at_c;  // of one sign: nothing cancels, and it is zero only edge-on
  const double share = 1 / whole;
  const double u = s.at_b * share, v = s.at_c * share;
  // A mean: never outside the triangle's depths.
  const double t = (s.at_a * share * s.depth_a + u * s.depth_b + v * s.depth_c) / dz;
  TriangleHit hit;
  hit.t = s.inside & (whole != 0) & (t > 0) & (t <= std::numeric_limits<double>::max()) ? t : hit.t;
  hit.u = u < 1 ? u : 1;
  hit.v = v < 1 - hit.u ? v : 1 - hit.u;
  return hit;
}

}  // namespace tracer
