#pragma once
/// Surface points and normals of the simplest primitives, bit-identical for single hits and packets.

#include "tracer/src/math/lanes.h"
#include "tracer/src/math/rounding.h"

namespace tracer {

/// A point on a primitive, its error bound, and the outward normal.
struct PrimitivePoint {
  Vec3 position, error;
  Vec3 across;  ///< not unit in general
};

/// The point of a sphere next to `on_ray`. Points on rays lose digits with the ray's length, so the point is projected
/// onto the sphere; the remaining error is the rounding of that and of the quadratic's constant term, which sixteen
/// operations cover.
WHITTLE_INLINE PrimitivePoint sphere_point(const Vec3& center, double radius, const Vec3& on_ray) {
  const Vec3 scaled = (on_ray - center) / radius;
  const double distance = length(scaled);  // 0 where a ray from 10^16 radii away has no digit left for the surface
  const double stretch = distance > 0 ? 1 / distance : 0;
  const Vec3 normal = scaled * stretch;
  const Vec3 arm = normal * radius;
  const Vec3 position = center + arm;
  // By components: a copy of the whole would keep the loop from being vectorized.
  return {position,
          abs(arm) * rounding_bound(16) + (abs(position) + abs(center)) * rounding_bound(2),
          {normal.x, normal.y, normal.z}};
}

/// Position and error from the barycentric coordinates (PBR 4th ed., sec. 6.8.5).
WHITTLE_INLINE PrimitivePoint triangle_point(const Vec3& a, const Vec3& b, const Vec3& c, double u, double v) {
  const Vec3 from_a = a * (1 - u - v), from_b = b * u, from_c = c * v;
  return {from_a + from_b + from_c, (abs(from_a) + abs(from_b) + abs(from_c)) * rounding_bound(7), cross(b - a, c - a)};
}

/// The point of a plane next to `on_ray`.
WHITTLE_INLINE PrimitivePoint plane_point(const Vec3& point, const Vec3& normal, const Vec3& on_ray) {
  const Vec3 position = on_ray - normal * dot(on_ray - point, normal);
  return {position, (abs(position) + abs(point)) * rounding_bound(8), {normal.x, normal.y, normal.z}};
}

/// A vertex of a triangle, and its weight at the hit.
struct SmoothVertex {
  Vec3 position, normal;
  double weight;
};

/// One vertex's part of the offset from a point of a triangle to the curved surface that the vertex normals suggest:
/// the mean of its projections onto the vertices' tangent planes, if these are outside. Shadow rays start there;
/// otherwise the facets of a coarse mesh would shadow each other although their normals face the light (Hanika 2021,
/// "Hacking the Shadow Terminator", Ray Tracing Gems II, ch. 4).
WHITTLE_INLINE Vec3 toward_tangent_plane(const SmoothVertex& vertex, const Vec3& position, const Vec3& face) {
  const double side = dot(vertex.normal, face) < 0 ? -1.0 : 1.0;
  const Vec3 normal = vertex.normal * side;
  const double height = dot(position - vertex.position, normal);
  return normal * (-(height < 0 ? height : 0.0) * vertex.weight);
}

/// Shading normal and shadow offset of a triangle with the geometric normal `face`.
struct SmoothPoint {
  Vec3 normal;         ///< unit, on the side of `face`
  Vec3 shadow_offset;  ///< to the curved surface
};

/// A vertex without a normal of its own has the zero vector. If the normals cancel, the normal of the face is used.
WHITTLE_INLINE SmoothPoint smooth_point(const SmoothVertex& a, const SmoothVertex& b, const SmoothVertex& c,
                                        const Vec3& position, const Vec3& face) {
  const Vec3 sum = a.normal * a.weight + b.normal * b.weight + c.normal * c.weight;
  const double squared = dot(sum, sum);
  const double curved = squared > 0x1p-40 ? 1.0 : 0.0;
  const double side = dot(sum, face) < 0 ? -1.0 : 1.0;
  const double size = std::sqrt(squared);
  const Vec3 offset = toward_tangent_plane(a, position, face) + toward_tangent_plane(b, position, face) +
                      toward_tangent_plane(c, position, face);
  return {select(curved > 0, sum / size * side, face), {offset.x * curved, offset.y * curved, offset.z * curved}};
}

}  // namespace tracer
