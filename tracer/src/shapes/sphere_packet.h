#pragma once
/// Where rays meet spheres, sixteen at a time.

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/math/rounding.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// The point of a sphere next to `on_ray`. The ray's own arithmetic loses digits with its length, so the point is
/// pulled back onto the sphere; what is left is the rounding of that and of the quadratic's constant term, which
/// sixteen operations cover.
struct SpherePoint {
  Vec3 position, error, normal;
};
WHITTLE_INLINE SpherePoint sphere_point(const Vec3& center, double radius, const Vec3& on_ray) {
  const Vec3 scaled = (on_ray - center) / radius;
  const double distance = length(scaled);  // 0 where a ray from 10^16 radii away has no digit left for the surface
  const double stretch = distance > 0 ? 1 / distance : 0;
  const Vec3 normal = scaled * stretch;
  const Vec3 arm = normal * radius;
  const Vec3 position = center + arm;
  return {position, abs(arm) * rounding_bound(16) + (abs(position) + abs(center)) * rounding_bound(2), normal};
}

/// Beside sixteen rays: what surface_at would find where they meet spheres. Other lanes mean nothing.
struct alignas(64) SpherePacket {
  double x[lanes], y[lanes], z[lanes];
  double error_x[lanes], error_y[lanes], error_z[lanes];
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];

  [[nodiscard]] BoundedPoint point(std::size_t i) const {
    return {{x[i], y[i], z[i]}, {error_x[i], error_y[i], error_z[i]}};
  }
  [[nodiscard]] Vec3 normal(std::size_t i) const { return {normal_x[i], normal_y[i], normal_z[i]}; }
};

/// Of the rays from `first` on, which met `hits`, as many as there are.
void meet_spheres(const GeometrySet& geometry, const RaySpan& rays, const PrimitiveRef* hits, const double* t,
                  std::size_t first, SpherePacket& packet);

}  // namespace tracer
