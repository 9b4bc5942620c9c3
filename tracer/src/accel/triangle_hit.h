#pragma once
/// Intersection of a ray and a triangle in double precision. No ray passes between triangles that share an edge or a
/// vertex: Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1). Branch-free.
///
/// It is watertight because: (1) The projection of a vertex across the ray depends on the ray and on that vertex only,
/// so triangles that share a vertex use the same, if rounded, projection. (2) The function of an edge a*b - c*d has,
/// rounded, the sign of the exact one or is zero: rounding is monotonic, so a*b > c*d never becomes <, and contraction,
/// which would break it, is off. From the other side the same edge gives exactly its negative. (3) Comparisons are
/// closed: zero belongs to both sides. So a ray hits at least one of the triangles around an edge or a vertex. Their
/// method resolves ties in higher precision to select one; here both are hits and the lowest primitive wins.

#include <limits>

#include "tracer/src/accel/geometry.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// The dominant axis is that of the largest component of a direction; between equal ones the choice changes no hit.
WHITTLE_INLINE bool x_is_dominant(const Vec3& d) {
  return (std::abs(d.x) >= std::abs(d.y)) & (std::abs(d.x) > std::abs(d.z));
}
/// True if y is dominant. Precondition: x is not.
WHITTLE_INLINE bool y_exceeds_z(const Vec3& d) { return std::abs(d.y) > std::abs(d.z); }

/// `t` is NaN, which is nearer than nothing, if there is no hit.
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

/// Swaps the ray's dominant axis into z: projecting along it loses no digits. The swap changes no hit, since both sides
/// of a triangle count. Instead of shearing by d.x / d.z all is multiplied by d.z: no division.
struct RayShear {
  Vec3 origin;
  double dx, dy, dz;
  bool along_x, along_y;  ///< the dominant axis; neither: z
};

WHITTLE_INLINE RayShear ray_shear(const Vec3& o, const Vec3& d, bool along_x, bool along_y) {
  return {o, along_x ? d.z : d.x, along_y ? d.z : d.y, along_x ? d.x : (along_y ? d.y : d.z), along_x, along_y};
}

WHITTLE_INLINE RayShear ray_shear(const Vec3& o, const Vec3& d) {
  const bool along_x = x_is_dominant(d);
  return ray_shear(o, d, along_x, !along_x & y_exceeds_z(d));
}

/// A vertex relative to the ray: x and y across it, z along it, each times the ray's dominant component.
struct ShearedVertex {
  double x, y, z;
};

WHITTLE_INLINE ShearedVertex sheared(const RayShear& ray, const Vec3& vertex) {
  const double x = vertex.x - ray.origin.x, y = vertex.y - ray.origin.y, z = vertex.z - ray.origin.z;
  const double across_x = ray.along_x ? z : x, across_y = ray.along_y ? z : y;
  const double along = ray.along_x ? x : (ray.along_y ? y : z);
  return {across_x * ray.dz - along * ray.dx, across_y * ray.dz - along * ray.dy, along};
}

/// Functions of the edges, each named after the vertex across the edge: its share in their sum is that vertex's weight.
struct ShearedTriangle {
  double at_a, at_b, at_c;
  double depth_a, depth_b, depth_c;
  bool inside;
};

WHITTLE_INLINE double edge(const ShearedVertex& from, const ShearedVertex& to) { return to.x * from.y - to.y * from.x; }

WHITTLE_INLINE ShearedTriangle sheared(const RayShear& ray, const TriangleTest& triangle) {
  const ShearedVertex a = sheared(ray, triangle.a), b = sheared(ray, triangle.b), c = sheared(ray, triangle.c);
  const double at_a = edge(b, c), at_b = edge(c, a), at_c = edge(a, b);
  const bool inside = ((at_a >= 0) & (at_b >= 0) & (at_c >= 0)) | ((at_a <= 0) & (at_b <= 0) & (at_c <= 0));
  return {at_a, at_b, at_c, a.z, b.z, c.z, inside};
}

/// `dz` is the ray's dominant component.
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
