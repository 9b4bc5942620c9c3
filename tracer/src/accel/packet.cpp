#include "tracer/src/accel/packet.h"

#include <cstring>

#include "tracer/src/accel/triangle_pairs.h"

namespace tracer {
namespace {

struct SphereTest {
  Vec3 center;
  double radius;
};

SphereTest sphere_test(const SphereGeometry& g, std::uint32_t primitive) {
  return {g.center(primitive), g.radius[primitive]};
}

/// Quadratic equation of a unit ray and a sphere, before any root or quotient. The discriminant is R^2 minus the
/// squared distance of the line from the center, and the roots are c/q and q: neither cancels (Press et al. 2007,
/// sec. 5.6; Haines et al., Ray Tracing Gems 2019, ch. 7).
struct SphereQuadratic {
  double b;  ///< distance of the point of the line nearest to the center
  double c, discriminant;

  /// True if the line intersects the sphere, and not only behind the ray's origin: exactly if a root is positive.
  [[nodiscard]] WHITTLE_INLINE bool hit() const { return (discriminant >= 0) & ((b >= 0) | (c < 0)); }

  /// Nearest distance > 0. Precondition: hit().
  [[nodiscard]] WHITTLE_INLINE double distance() const {
    const double root = std::sqrt(discriminant);
    const double q = b >= 0 ? b + root : b - root;
    const double other = c / q;
    const double near = other < q ? other : q;
    const double far = other < q ? q : other;
    const double t = near > 0 ? near : far;
    return t > 0 ? t : std::numeric_limits<double>::quiet_NaN();
  }
};

WHITTLE_INLINE SphereQuadratic sphere_quadratic(const Packet& p, int i, const SphereTest& s) {
  const Vec3 d = p.direction[i], f = p.origin[i] - s.center;
  const double b = -dot(f, d);
  const Vec3 l = f + d * b;
  return {b, dot(f, f) - s.radius * s.radius, s.radius * s.radius - dot(l, l)};
}

/// Returns true if any valid lane hits the sphere: only these pay for root and quotient.
WHITTLE_INLINE bool any_sphere_hit(const Packet& p, LaneRange range, const int* valid, const SphereTest& sphere) {
  if (range.count == 1) return true;
  int hits = 0;
  for_lanes(
      range, [&](int i, int k)
                 __attribute__((always_inline)) { hits |= sphere_quadratic(p, i, sphere).hit() ? valid[k] : 0; });
  return hits != 0;
}

/// Calls intersect(lane, t) in all lanes; t is not positive and finite where the ray misses the plane or starts on it.
template <class Intersect>
WHITTLE_INLINE void for_plane_hits(const Packet& p, const PlaneGeometry& planes, PrimitiveRef self,
                                   const Intersect& intersect) {
  const Vec3 point = planes.point[self.primitive], normal = planes.normal[self.primitive];
  for (int i = 0; i < packet_size; ++i) {
    const double t = dot(point - p.origin[i], normal) / dot(p.direction[i], normal);
    intersect(i, t, (t > 0) & (t < std::numeric_limits<double>::max()) & !starts_on(p, i, self));
  }
}

/// Copies `count` lanes and fills the others with NaN, which hits nothing.
WHITTLE_INLINE void load_lanes(double* to, const double* from, int count) {
  std::memcpy(to, from, static_cast<std::size_t>(count) * sizeof(double));  // inline vector code for a constant count
  for (int i = count; i < packet_size; ++i) to[i] = std::numeric_limits<double>::quiet_NaN();
}

WHITTLE_INLINE void load_rays(Packet& packet, const RaySpan& rays, std::size_t first, int count) {
  load_lanes(packet.origin.x, rays.ox + first, count);
  load_lanes(packet.origin.y, rays.oy + first, count);
  load_lanes(packet.origin.z, rays.oz + first, count);
  load_lanes(packet.direction.x, rays.dx + first, count);
  load_lanes(packet.direction.y, rays.dy + first, count);
  load_lanes(packet.direction.z, rays.dz + first, count);
  if (rays.t_max != nullptr)
    load_lanes(packet.t, rays.t_max + first, count);
  else
    std::fill_n(packet.t, packet_size, std::numeric_limits<double>::infinity());
  const PrimitiveRef* from = rays.from + first;
  for (int i = 0; rays.from != nullptr && i < count; ++i) {
    packet.from_geometry[i] = from[i].geometry;
    packet.from_primitive[i] = from[i].primitive;
  }
}

WHITTLE_INLINE void store_hits(const Packet& packet, const HitSpan& hits, std::size_t first, int count) {
  const std::size_t bytes = static_cast<std::size_t>(count) * sizeof(double);
  PrimitiveRef* primitive = hits.primitive + first;
  for (int i = 0; i < count; ++i) primitive[i] = {packet.geometry[i], packet.primitive[i]};
  std::memcpy(hits.t + first, packet.t, bytes);
  std::memcpy(hits.u + first, packet.u, bytes);
  std::memcpy(hits.v + first, packet.v, bytes);
}

}  // namespace

void begin(Packet& packet, const RaySpan& rays, Coherence coherence, unsigned mask, RTCRay16& ray) {
  rtcInitIntersectContext(&packet.context);
  packet.context.flags =
      coherence == Coherence::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  if (rays.from == nullptr || rays.count % packet_size != 0) {
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

WHITTLE_WIDE void load(Packet& packet, const RaySpan& rays, std::size_t first, int count,
                       const BoundingSphere& sphere) {
  const Vec3 center = sphere.center;
  const double radius = sphere.radius;
  if (count == packet_size)
    load_rays(packet, rays, first, packet_size);
  else
    load_rays(packet, rays, first, count);
  std::fill_n(packet.geometry, packet_size, PrimitiveRef::none);
  std::fill_n(packet.primitive, packet_size, PrimitiveRef::none);
  std::fill_n(packet.blocked, packet_size, 0);
  for (int i = 0; i < packet_size; ++i) {
    const Vec3 f = center - packet.origin[i], d = packet.direction[i];
    const double nearest = dot(f, d);
    const Vec3 l = f - d * nearest;
    // The rounding errors above grow with the distance.
    const double error_bound = float_slack + std::abs(nearest) * 0x1p-48;
    const double enter = nearest - radius > 0 ? nearest - radius : 0;
    const double beyond = nearest + radius, leave = beyond < packet.t[i] ? beyond : packet.t[i];
    const double start = enter - error_bound, miss = radius + error_bound;
    packet.start[i] = start;
    packet.reach[i] = reach_of(leave + error_bound, start);
    // False for rays that are not finite: one of the sums then is infinite or NaN.
    const bool active = (dot(l, l) <= miss * miss) & (start <= leave) & (nearest < distance_max);
    packet.active[i] = active ? -1 : 0;
  }
}

WHITTLE_WIDE void load_for_triangles(Packet& packet, const BoundingSphere& sphere) {
  packet.float_bound = float_error_bound(sphere.away, sphere.radius);
  for (int i = 0; i < packet_size; ++i)
    packet.error_bound[i] = double_error_bound(packet.start[i], sphere.away, sphere.radius);
  constexpr int x = 1, y = 2, z = 4;
  int axes = 0;
  for (int i = 0; i < packet_size; ++i) {
    const Vec3 d = packet.direction[i];
    const int axis = x_is_dominant(d) ? x : (y_exceeds_z(d) ? y : z);
    axes |= packet.active[i] & axis;
  }
  packet.dominant = axes == x   ? DominantAxis::x
                    : axes == y ? DominantAxis::y
                    : axes == z ? DominantAxis::z
                                : DominantAxis::mixed;
}

WHITTLE_WIDE void write_rays(const Packet& packet, RTCRay16& ray) {
  for (int i = 0; i < packet_size; ++i) {
    const bool active = packet.active[i] != 0;
    const Vec3 d = packet.direction[i], o = packet.origin[i] + d * packet.start[i];
    // Inactive lanes get harmless values: this Embree asserts on a NaN even there.
    ray.org_x[i] = active ? static_cast<float>(o.x) : 0.0f;
    ray.org_y[i] = active ? static_cast<float>(o.y) : 0.0f;
    ray.org_z[i] = active ? static_cast<float>(o.z) : 0.0f;
    ray.dir_x[i] = active ? static_cast<float>(d.x) : 0.0f;
    ray.dir_y[i] = active ? static_cast<float>(d.y) : 0.0f;
    ray.dir_z[i] = active ? static_cast<float>(d.z) : 1.0f;
    ray.tfar[i] = active ? packet.reach[i] : 0.0f;
  }
}

WHITTLE_WIDE void write_hits(const Packet& packet, const HitSpan& hits, std::size_t first, int count) {
  if (count == packet_size)
    store_hits(packet, hits, first, packet_size);
  else
    store_hits(packet, hits, first, count);
}

WHITTLE_WIDE void write_blocked(const Packet& packet, const RTCRay16& ray, std::uint8_t* blocked, int count) {
  for (int i = 0; i < count; ++i) blocked[i] = static_cast<std::uint8_t>((packet.blocked[i] != 0) | (ray.tfar[i] < 0));
}

WHITTLE_WIDE void intersect(Packet& packet, LaneRange range, const int* valid, float* __restrict tfar,
                            RTCRayN* /*rays*/, const SphereGeometry& geometry, PrimitiveRef self) {
  const SphereTest sphere = sphere_test(geometry, self.primitive);
  if (!any_sphere_hit(packet, range, valid, sphere)) return;
  for_lanes(
      range, [&](int i, int k) __attribute__((always_inline)) {
        const SphereQuadratic quadratic = sphere_quadratic(packet, i, sphere);
        update_nearest(packet, i, tfar[k], quadratic.distance(), self, quadratic.hit() & (valid[k] != 0));
      });
}

WHITTLE_WIDE void occluded(const Packet& packet, LaneRange range, const int* valid, float* __restrict tfar,
                           RTCRayN* /*rays*/, const SphereGeometry& geometry, PrimitiveRef self) {
  const SphereTest sphere = sphere_test(geometry, self.primitive);
  if (!any_sphere_hit(packet, range, valid, sphere)) return;
  for_lanes(
      range, [&](int i, int k) __attribute__((always_inline)) {
        const SphereQuadratic quadratic = sphere_quadratic(packet, i, sphere);
        update_occluded(tfar[k], quadratic.hit() & (valid[k] != 0) & (quadratic.distance() < packet.t[i]));
      });
}

WHITTLE_WIDE void intersect_planes(Packet& packet, const PlaneGeometry& planes, std::uint32_t geometry,
                                   GeometryMask mask) {
  for (std::uint32_t k = 0; k < planes.point.size(); ++k) {
    if (mask != GeometryMask::all && (planes.transmissive[k] != 0) != (mask == GeometryMask::transmissive)) continue;
    const PrimitiveRef self{geometry, k};
    for_plane_hits(
        packet, planes, self, [&](int i, double t, bool hit) __attribute__((always_inline)) {
          float reach = packet.reach[i];
          update_nearest(packet, i, reach, t, self, hit);
          packet.reach[i] = reach < packet.reach[i] ? reach : packet.reach[i];
        });
  }
  // A plane nearer than the start of Embree's ray leaves nothing to traverse.
  for (int i = 0; i < packet_size; ++i) packet.active[i] = packet.reach[i] < 0 ? 0 : packet.active[i];
}

WHITTLE_WIDE void occluded_by_planes(Packet& packet, const PlaneGeometry& planes, std::uint32_t geometry) {
  for (std::uint32_t k = 0; k < planes.point.size(); ++k) {
    if (planes.transmissive[k] != 0) continue;
    for_plane_hits(
        packet, planes, {geometry, k}, [&](int i, double t, bool hit) __attribute__((always_inline)) {
          const bool blocked = hit & (t < packet.t[i]);
          packet.blocked[i] = blocked ? -1 : packet.blocked[i];
          packet.active[i] = blocked ? 0 : packet.active[i];
        });
  }
}

}  // namespace tracer
