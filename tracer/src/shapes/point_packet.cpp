#include "tracer/src/shapes/point_packet.h"

#include <algorithm>

namespace tracer {
namespace {

/// Between these the largest component lies where normalize() divides by the length and does nothing else.
constexpr double plain_min = 0x1p-300, plain_max = 0x1p300;

/// All lanes together cost about what so many do one by one.
constexpr int worthwhile = 4;

/// What the rays met, gathered beside them.
struct alignas(64) Spheres {
  double x[lanes], y[lanes], z[lanes], radius[lanes];  ///< radius 0: none
  double ray_x[lanes], ray_y[lanes], ray_z[lanes];     ///< where the ray's arithmetic has the hit
};
struct alignas(64) Triangles {
  double ax[lanes], ay[lanes], az[lanes];
  double bx[lanes], by[lanes], bz[lanes];
  double cx[lanes], cy[lanes], cz[lanes];
  double u[lanes], v[lanes];
  double met[lanes];  ///< 1 or 0
};

WHITTLE_INLINE void put(const PrimitivePoint& at, const Vec3& normal, bool known, int i, PointPacket& p) {
  p.x[i] = known ? at.position.x : p.x[i];
  p.y[i] = known ? at.position.y : p.y[i];
  p.z[i] = known ? at.position.z : p.z[i];
  p.error_x[i] = known ? at.error.x : p.error_x[i];
  p.error_y[i] = known ? at.error.y : p.error_y[i];
  p.error_z[i] = known ? at.error.z : p.error_z[i];
  p.normal_x[i] = known ? normal.x : p.normal_x[i];
  p.normal_y[i] = known ? normal.y : p.normal_y[i];
  p.normal_z[i] = known ? normal.z : p.normal_z[i];
  p.known[i] = known ? 1 : p.known[i];
}

WHITTLE_WIDE void meet_spheres(const Spheres& s, PointPacket& p) {
  for (int i = 0; i < lanes; ++i) {
    const PrimitivePoint at = sphere_point({s.x[i], s.y[i], s.z[i]}, s.radius[i], {s.ray_x[i], s.ray_y[i], s.ray_z[i]});
    put(at, at.across, s.radius[i] > 0, i, p);
  }
}

WHITTLE_WIDE void meet_triangles(const Triangles& s, PointPacket& p) {
  for (int i = 0; i < lanes; ++i) {
    const PrimitivePoint at = triangle_point({s.ax[i], s.ay[i], s.az[i]}, {s.bx[i], s.by[i], s.bz[i]},
                                             {s.cx[i], s.cy[i], s.cz[i]}, s.u[i], s.v[i]);
    const double size = length(at.across);
    const double x = std::abs(at.across.x), y = std::abs(at.across.y), z = std::abs(at.across.z);
    const double xy = x > y ? x : y, largest = xy > z ? xy : z;
    put(at, at.across / size, (s.met[i] > 0) & (largest > plain_min) & (largest < plain_max), i, p);
  }
}

void gather(const SphereGeometry& from, std::uint32_t sphere, const RaySpan& rays, std::size_t ray, double t, int i,
            Spheres& to) {
  to.x[i] = from.x[sphere];
  to.y[i] = from.y[sphere];
  to.z[i] = from.z[sphere];
  to.radius[i] = from.radius[sphere];
  to.ray_x[i] = rays.ox[ray] + rays.dx[ray] * t;
  to.ray_y[i] = rays.oy[ray] + rays.dy[ray] * t;
  to.ray_z[i] = rays.oz[ray] + rays.dz[ray] * t;
}

void gather(const TriangleGeometry& from, std::uint32_t triangle, double u, double v, int i, Triangles& to) {
  const auto [a, b, c] = from.triangles[triangle];
  const Vec3 &pa = from.position(a), &pb = from.position(b), &pc = from.position(c);
  to.ax[i] = pa.x;
  to.ay[i] = pa.y;
  to.az[i] = pa.z;
  to.bx[i] = pb.x;
  to.by[i] = pb.y;
  to.bz[i] = pb.z;
  to.cx[i] = pc.x;
  to.cy[i] = pc.y;
  to.cz[i] = pc.z;
  to.u[i] = u;
  to.v[i] = v;
  to.met[i] = 1;
}

}  // namespace

void meet_points(const GeometrySet& geometry, const RaySpan& rays, const HitSpan& hits, std::size_t first,
                 PointPacket& packet) {
  const int count = static_cast<int>(std::min<std::size_t>(lanes, rays.count - first));
  const std::uint32_t triangles_from = geometry.first_triangles(), others_from = geometry.first_quadrics();
  Spheres spheres;
  Triangles triangles;
  int sphere_count = 0, triangle_count = 0;
  std::fill_n(spheres.radius, lanes, 0.0);
  std::fill_n(triangles.met, lanes, 0.0);
  std::fill_n(packet.known, lanes, 0.0);
  for (int i = 0; i < count; ++i) {
    const std::size_t ray = first + static_cast<std::size_t>(i);
    const auto [set, primitive] = hits.primitive[ray];
    if (set < triangles_from) {
      gather(geometry.spheres[set], primitive, rays, ray, hits.t[ray], i, spheres);
      ++sphere_count;
    } else if (set < others_from && geometry.triangles[set - triangles_from].normals.empty()) {
      gather(geometry.triangles[set - triangles_from], primitive, hits.u[ray], hits.v[ray], i, triangles);
      ++triangle_count;
    }
  }
  if (sphere_count >= worthwhile) meet_spheres(spheres, packet);
  if (triangle_count >= worthwhile) meet_triangles(triangles, packet);
}

}  // namespace tracer
