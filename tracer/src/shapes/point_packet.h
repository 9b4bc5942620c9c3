#pragma once
/// Where rays meet spheres and flat triangles, sixteen at a time: most of what most scenes consist of.

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/math/rounding.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// A point on a primitive, how far it may be from it, and the outward direction across it there.
struct PrimitivePoint {
  Vec3 position, error;
  Vec3 across;  ///< a sphere's is unit
};

/// The point of a sphere next to `on_ray`. The ray's own arithmetic loses digits with its length, so the point is
/// pulled back onto the sphere; what is left is the rounding of that and of the quadratic's constant term, which
/// sixteen operations cover.
WHITTLE_INLINE PrimitivePoint sphere_point(const Vec3& center, double radius, const Vec3& on_ray) {
  const Vec3 scaled = (on_ray - center) / radius;
  const double distance = length(scaled);  // 0 where a ray from 10^16 radii away has no digit left for the surface
  const double stretch = distance > 0 ? 1 / distance : 0;
  const Vec3 normal = scaled * stretch;
  const Vec3 arm = normal * radius;
  const Vec3 position = center + arm;
  // By components: copied as a whole it would keep the loop from becoming vector code.
  return {position,
          abs(arm) * rounding_bound(16) + (abs(position) + abs(center)) * rounding_bound(2),
          {normal.x, normal.y, normal.z}};
}

/// Position and error from the barycentric coordinates (PBR 4th ed., sec. 6.8.5).
WHITTLE_INLINE PrimitivePoint triangle_point(const Vec3& a, const Vec3& b, const Vec3& c, double u, double v) {
  const Vec3 from_a = a * (1 - u - v), from_b = b * u, from_c = c * v;
  return {from_a + from_b + from_c, (abs(from_a) + abs(from_b) + abs(from_c)) * rounding_bound(7), cross(b - a, c - a)};
}

/// Beside sixteen rays.
struct alignas(64) PointPacket {
  double x[lanes], y[lanes], z[lanes];
  double error_x[lanes], error_y[lanes], error_z[lanes];
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];  ///< unit, outward
  double known[lanes];                                       ///< 1 where the lane holds a point; 0: surface_at knows

  [[nodiscard]] BoundedPoint point(std::size_t i) const {
    return {{x[i], y[i], z[i]}, {error_x[i], error_y[i], error_z[i]}};
  }
  [[nodiscard]] Vec3 normal(std::size_t i) const { return {normal_x[i], normal_y[i], normal_z[i]}; }
};

/// Of the rays from `first` on, which met `hits`, as many as there are. Triangles with normals of their own are none of
/// these, nor are those so large or small that the range of numbers needs care, nor primitives of a kind that few of
/// the sixteen rays met.
void meet_points(const GeometrySet& geometry, const RaySpan& rays, const HitSpan& hits, std::size_t first,
                 PointPacket& packet);

}  // namespace tracer
