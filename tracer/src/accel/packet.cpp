#include "tracer/src/accel/packet.h"

#include <cstring>
#include <limits>

#include "tracer/src/accel/dominant_axis.h"

namespace tracer {
namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();  // compares false with every distance

struct SphereTest {
  double x, y, z, radius;
};

SphereTest sphere_test(const SphereGeometry& g, std::uint32_t primitive) {
  return {g.x[primitive], g.y[primitive], g.z[primitive], g.radius[primitive]};
}

/// What decides whether a unit ray meets a sphere, before any root or quotient. The discriminant is R^2 minus the
/// squared distance of the line from the centre, and the roots come as c/q and q: neither cancels
/// (Press et al. 2007, sec. 5.6; Haines et al., Ray Tracing Gems 2019, ch. 7).
struct SphereQuadratic {
  double b;  ///< distance to the place nearest to the centre
  double c, discriminant;
};

WHITTLE_INLINE SphereQuadratic sphere_line(double ox, double oy, double oz, double dx, double dy, double dz,
                                           const SphereTest& s) {
  const double fx = ox - s.x, fy = oy - s.y, fz = oz - s.z;
  const double b = -(fx * dx + fy * dy + fz * dz);
  const double lx = fx + b * dx, ly = fy + b * dy, lz = fz + b * dz;
  return {b, fx * fx + fy * fy + fz * fz - s.radius * s.radius, s.radius * s.radius - (lx * lx + ly * ly + lz * lz)};
}

/// Whether the line meets the sphere, and not only behind the ray's origin: exactly when a root is positive.
WHITTLE_INLINE bool meets(const SphereQuadratic& line) {
  return (line.discriminant >= 0) & ((line.b >= 0) | (line.c < 0));
}

/// Nearest distance > 0, or `nothing`, of a line that meets the sphere.
WHITTLE_INLINE double sphere_distance(const SphereQuadratic& line) {
  const double root = std::sqrt(line.discriminant);
  const double q = line.b >= 0 ? line.b + root : line.b - root;
  const double other = line.c / q;
  const double near = other < q ? other : q;
  const double far = other < q ? q : other;
  const double t = near > 0 ? near : far;
  return t > 0 ? t : nothing;
}

WHITTLE_INLINE SphereQuadratic lane_line(const Packet& p, int i, const SphereTest& sphere) {
  return sphere_line(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i], sphere);
}

/// Whether any of the lanes that count meets the sphere: only these pay for root and quotient.
WHITTLE_INLINE bool any_hit(const Packet& p, Asked asked, const int* valid, const SphereTest& sphere) {
  int met = 0;
  for_lanes(
      asked, [&](int i, int k)
                 __attribute__((always_inline)) { met |= meets(lane_line(p, i, sphere)) ? valid[k] : 0; });
  return met != 0;
}

struct PlaneTest {
  Vec3 point, normal;
};

WHITTLE_INLINE double plane_distance(const Packet& p, int i, const PlaneTest& plane) {
  const auto& [point, normal] = plane;
  const double height =
      (point.x - p.ox[i]) * normal.x + (point.y - p.oy[i]) * normal.y + (point.z - p.oz[i]) * normal.z;
  return height / (p.dx[i] * normal.x + p.dy[i] * normal.y + p.dz[i] * normal.z);
}

double lane_distance(const Packet& p, unsigned i, const SphereTest& sphere) {
  const SphereQuadratic line = sphere_line(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i], sphere);
  return meets(line) ? sphere_distance(line) : nothing;
}

/// Copied as vectors and not by a call.
WHITTLE_INLINE void copy_lanes(double* to, const double* from) { std::memcpy(to, from, packet_size * sizeof(double)); }

}  // namespace

void begin(Packet& packet, const RaySpan& rays, Coherence coherence, unsigned mask, RTCRay16& ray) {
  rtcInitIntersectContext(&packet.context);
  packet.context.flags =
      coherence == Coherence::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  if (rays.from == nullptr) {
    std::fill_n(packet.from_geometry, packet_size, PrimitiveRef::none);
    std::fill_n(packet.from_primitive, packet_size, PrimitiveRef::none);
  }
  for (int i = 0; i < packet_size; ++i) {
    ray.tnear[i] = 0;
    ray.time[i] = 0;
    ray.mask[i] = mask;
    ray.id[i] = static_cast<unsigned>(i);
    ray.flags[i] = 0;
  }
}

WHITTLE_WIDE void load(Packet& packet, const RaySpan& rays, std::size_t first, const BoundingSphere& ball) {
  const Vec3 center = ball.center;
  const double radius = ball.radius;
  copy_lanes(packet.ox, rays.ox + first);
  copy_lanes(packet.oy, rays.oy + first);
  copy_lanes(packet.oz, rays.oz + first);
  copy_lanes(packet.dx, rays.dx + first);
  copy_lanes(packet.dy, rays.dy + first);
  copy_lanes(packet.dz, rays.dz + first);
  if (rays.t_max != nullptr)
    copy_lanes(packet.t, rays.t_max + first);
  else
    std::fill_n(packet.t, packet_size, std::numeric_limits<double>::infinity());
  std::fill_n(packet.geometry, packet_size, PrimitiveRef::none);
  std::fill_n(packet.primitive, packet_size, PrimitiveRef::none);
  std::fill_n(packet.blocked, packet_size, 0);
  for (int i = 0; rays.from != nullptr && i < packet_size; ++i) {
    packet.from_geometry[i] = rays.from[first + i].geometry;
    packet.from_primitive[i] = rays.from[first + i].primitive;
  }
  for (int i = 0; i < packet_size; ++i) {
    const double fx = center.x - packet.ox[i], fy = center.y - packet.oy[i], fz = center.z - packet.oz[i];
    const double dx = packet.dx[i], dy = packet.dy[i], dz = packet.dz[i];
    const double nearest = fx * dx + fy * dy + fz * dz;
    const double lx = fx - nearest * dx, ly = fy - nearest * dy, lz = fz - nearest * dz;
    // What was rounded above grows with the distance.
    const double error_bound = float_slack + std::abs(nearest) * 0x1p-48;
    const double enter = nearest - radius > 0 ? nearest - radius : 0;
    const double beyond = nearest + radius, leave = beyond < packet.t[i] ? beyond : packet.t[i];
    const double start = enter - error_bound, miss = radius + error_bound;
    packet.start[i] = start;
    packet.reach[i] = reach_of(leave + error_bound, start);
    // False for what is not finite: one of the sums then is infinite or NaN.
    const bool active = (lx * lx + ly * ly + lz * lz <= miss * miss) & (start <= leave) & (nearest < distance_max);
    packet.active[i] = active ? -1 : 0;
  }
}

WHITTLE_WIDE void load_for_triangles(Packet& packet, const BoundingSphere& ball) {
  packet.float_bound = float_error_bound(ball.away, ball.radius);
  for (int i = 0; i < packet_size; ++i)
    packet.error_bound[i] = double_error_bound(packet.start[i], ball.away, ball.radius);
  constexpr int x = 1, y = 2, z = 4;
  int axes = 0;
  for (int i = 0; i < packet_size; ++i) {
    const bool along_x = x_is_dominant(packet.dx[i], packet.dy[i], packet.dz[i]);
    const int axis = along_x ? x : (y_leads(packet.dy[i], packet.dz[i]) ? y : z);
    axes |= packet.active[i] & axis;
  }
  packet.leading = axes == x   ? DominantAxis::x
                   : axes == y ? DominantAxis::y
                   : axes == z ? DominantAxis::z
                               : DominantAxis::mixed;
}

WHITTLE_WIDE void write_rays(const Packet& packet, RTCRay16& ray) {
  for (int i = 0; i < packet_size; ++i) {
    const bool active = packet.active[i] != 0;
    // Inactive lanes get harmless numbers: this Embree asserts on a NaN even there.
    ray.org_x[i] = active ? static_cast<float>(packet.ox[i] + packet.start[i] * packet.dx[i]) : 0.0f;
    ray.org_y[i] = active ? static_cast<float>(packet.oy[i] + packet.start[i] * packet.dy[i]) : 0.0f;
    ray.org_z[i] = active ? static_cast<float>(packet.oz[i] + packet.start[i] * packet.dz[i]) : 0.0f;
    ray.dir_x[i] = active ? static_cast<float>(packet.dx[i]) : 0.0f;
    ray.dir_y[i] = active ? static_cast<float>(packet.dy[i]) : 0.0f;
    ray.dir_z[i] = active ? static_cast<float>(packet.dz[i]) : 1.0f;
    ray.tfar[i] = active ? packet.reach[i] : 0.0f;
  }
}

WHITTLE_WIDE void write_hits(const Packet& packet, const HitSpan& hits, std::size_t first) {
  for (int i = 0; i < packet_size; ++i) hits.primitive[first + i] = {packet.geometry[i], packet.primitive[i]};
  copy_lanes(hits.t + first, packet.t);
  copy_lanes(hits.u + first, packet.u);
  copy_lanes(hits.v + first, packet.v);
}

WHITTLE_WIDE void write_blocked(const Packet& packet, const RTCRay16& ray, std::uint8_t* blocked) {
  for (int i = 0; i < packet_size; ++i)
    blocked[i] = static_cast<std::uint8_t>((packet.blocked[i] != 0) | (ray.tfar[i] < 0));
}

WHITTLE_WIDE void intersect(Packet& packet, Asked asked, const int* valid, float* __restrict tfar,
                            const SphereGeometry& geometry, PrimitiveRef self) {
  const SphereTest sphere = sphere_test(geometry, self.primitive);
  if (!any_hit(packet, asked, valid, sphere)) return;
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        const SphereQuadratic line = lane_line(packet, i, sphere);
        const double t = sphere_distance(line);
        const bool nearer =
            meets(line) & (valid[k] != 0) & wins(t, self, packet.t[i], packet.geometry[i], packet.primitive[i]);
        packet.t[i] = nearer ? t : packet.t[i];
        packet.geometry[i] = nearer ? self.geometry : packet.geometry[i];
        packet.primitive[i] = nearer ? self.primitive : packet.primitive[i];
        tfar[k] = nearer ? reach_of(t, packet.start[i]) : tfar[k];
      });
}

WHITTLE_WIDE void occluded(const Packet& packet, Asked asked, const int* valid, float* __restrict tfar,
                           const SphereGeometry& geometry, PrimitiveRef self) {
  const SphereTest sphere = sphere_test(geometry, self.primitive);
  if (!any_hit(packet, asked, valid, sphere)) return;
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        const SphereQuadratic line = lane_line(packet, i, sphere);
        const bool blocked = meets(line) & (valid[k] != 0) & (sphere_distance(line) < packet.t[i]);
        tfar[k] = blocked ? -std::numeric_limits<float>::infinity() : tfar[k];
      });
}

void closest_lane(Packet& packet, unsigned lane, float& tfar, const SphereGeometry& geometry, PrimitiveRef self) {
  const double t = lane_distance(packet, lane, sphere_test(geometry, self.primitive));
  if (!wins(t, self, packet.t[lane], packet.geometry[lane], packet.primitive[lane])) return;
  packet.t[lane] = t;
  packet.geometry[lane] = self.geometry;
  packet.primitive[lane] = self.primitive;
  tfar = reach_of(t, packet.start[lane]);
}

void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const SphereGeometry& geometry,
                   PrimitiveRef self) {
  const double t = lane_distance(packet, lane, sphere_test(geometry, self.primitive));
  if (t < packet.t[lane]) tfar = -std::numeric_limits<float>::infinity();
}

WHITTLE_WIDE void closest_planes(Packet& packet, const PlaneGeometry& planes, std::uint32_t geometry,
                                 GeometryMask mask) {
  for (std::size_t k = 0; k < planes.point.size(); ++k) {
    if (mask != GeometryMask::all && (planes.transmissive[k] != 0) != (mask == GeometryMask::transmissive)) continue;
    const PlaneTest plane{planes.point[k], planes.normal[k]};
    const PrimitiveRef self{geometry, static_cast<std::uint32_t>(k)};
    for (int i = 0; i < packet_size; ++i) {
      const double t = plane_distance(packet, i, plane);
      const bool nearer = (t > 0) & (t < std::numeric_limits<double>::max()) &
                          !starts_on(packet, static_cast<unsigned>(i), self) &
                          wins(t, self, packet.t[i], packet.geometry[i], packet.primitive[i]);
      packet.t[i] = nearer ? t : packet.t[i];
      packet.geometry[i] = nearer ? self.geometry : packet.geometry[i];
      packet.primitive[i] = nearer ? self.primitive : packet.primitive[i];
      const float reach = reach_of(t, packet.start[i]);
      packet.reach[i] = nearer & (reach < packet.reach[i]) ? reach : packet.reach[i];
    }
  }
  // A plane nearer than the place where Embree's ray starts leaves nothing to look for.
  for (int i = 0; i < packet_size; ++i) packet.active[i] = packet.reach[i] < 0 ? 0 : packet.active[i];
}

WHITTLE_WIDE void occluded_planes(Packet& packet, const PlaneGeometry& planes, std::uint32_t geometry) {
  for (std::size_t k = 0; k < planes.point.size(); ++k) {
    if (planes.transmissive[k] != 0) continue;
    const PlaneTest plane{planes.point[k], planes.normal[k]};
    const PrimitiveRef self{geometry, static_cast<std::uint32_t>(k)};
    for (int i = 0; i < packet_size; ++i) {
      const double t = plane_distance(packet, i, plane);
      const bool met = !starts_on(packet, static_cast<unsigned>(i), self) & (t > 0) & (t < packet.t[i]) &
                       (t < std::numeric_limits<double>::max());
      packet.blocked[i] = met ? -1 : packet.blocked[i];
      packet.active[i] = met ? 0 : packet.active[i];
    }
  }
}

}  // namespace tracer
