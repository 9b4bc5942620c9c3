#include "tracer/src/shapes/sphere_packet.h"

#include <algorithm>

namespace tracer {
namespace {

struct alignas(64) Spheres {
  double x[lanes], y[lanes], z[lanes], radius[lanes];
};

WHITTLE_WIDE void meet(const Spheres& s, const RaySpan& rays, const double* t, std::size_t first, int count,
                       SpherePacket& p) {
  const double *ox = rays.ox + first, *oy = rays.oy + first, *oz = rays.oz + first;
  const double *dx = rays.dx + first, *dy = rays.dy + first, *dz = rays.dz + first;
  for (int i = 0; i < count; ++i) {
    const Vec3 on_ray{ox[i] + dx[i] * t[i], oy[i] + dy[i] * t[i], oz[i] + dz[i] * t[i]};
    const SpherePoint at = sphere_point({s.x[i], s.y[i], s.z[i]}, s.radius[i], on_ray);
    p.x[i] = at.position.x;
    p.y[i] = at.position.y;
    p.z[i] = at.position.z;
    p.error_x[i] = at.error.x;
    p.error_y[i] = at.error.y;
    p.error_z[i] = at.error.z;
    p.normal_x[i] = at.normal.x;
    p.normal_y[i] = at.normal.y;
    p.normal_z[i] = at.normal.z;
  }
}

}  // namespace

void meet_spheres(const GeometrySet& geometry, const RaySpan& rays, const PrimitiveRef* hits, const double* t,
                  std::size_t first, SpherePacket& packet) {
  const int count = static_cast<int>(std::min<std::size_t>(lanes, rays.count - first));
  const std::uint32_t others = geometry.first_triangles();
  Spheres met;
  bool any = false;
  for (int i = 0; i < count; ++i) {
    const auto [set, sphere] = hits[first + static_cast<std::size_t>(i)];
    met.x[i] = met.y[i] = met.z[i] = 0;
    met.radius[i] = 1;
    if (set >= others) continue;
    const SphereGeometry& spheres = geometry.spheres[set];
    met.x[i] = spheres.x[sphere];
    met.y[i] = spheres.y[sphere];
    met.z[i] = spheres.z[sphere];
    met.radius[i] = spheres.radius[sphere];
    any = true;
  }
  if (any) meet(met, rays, t + first, first, count, packet);
}

}  // namespace tracer
