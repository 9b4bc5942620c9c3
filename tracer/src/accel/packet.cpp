#include "tracer/src/accel/packet.h"

#include <limits>

#include "tracer/src/accel/leading_axis.h"

namespace tracer {
namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();  // compares false with every distance

struct SphereTest {
  double x, y, z, radius;
};

SphereTest sphere_test(const SphereGeometry& g, std::uint32_t primitive) {
  return {g.x[primitive], g.y[primitive], g.z[primitive], g.radius[primitive]};
}

/// Nearest distance > 0 at which a unit ray meets the sphere, or `nothing`. The discriminant is R^2 minus the squared
/// distance of the line from the centre, and the roots come as c/q and q: neither cancels
/// (Press et al. 2007, sec. 5.6; Haines et al., Ray Tracing Gems 2019, ch. 7).
WHITTLE_INLINE double sphere_distance(double ox, double oy, double oz, double dx, double dy, double dz,
                                      const SphereTest& s) {
  const double fx = ox - s.x, fy = oy - s.y, fz = oz - s.z;
  const double b = -(fx * dx + fy * dy + fz * dz);
  const double lx = fx + b * dx, ly = fy + b * dy, lz = fz + b * dz;
  const double discriminant = s.radius * s.radius - (lx * lx + ly * ly + lz * lz);
  const double c = fx * fx + fy * fy + fz * fz - s.radius * s.radius;
  const double root = std::sqrt(discriminant > 0 ? discriminant : 0);
  const double q = b >= 0 ? b + root : b - root;
  const double other = c / q;
  const double near = other < q ? other : q;
  const double far = other < q ? q : other;
  const double t = near > 0 ? near : far;
  return (discriminant >= 0) & (t > 0) ? t : nothing;
}

}  // namespace

WHITTLE_WIDE void load(Packet& packet, const RaySpan& rays, std::size_t first, int count, const Bounds& box) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const std::pair<const double*, double*> components[] = {{rays.ox, packet.ox}, {rays.oy, packet.oy},
                                                          {rays.oz, packet.oz}, {rays.dx, packet.dx},
                                                          {rays.dy, packet.dy}, {rays.dz, packet.dz}};
  for (const auto& [from, to] : components) {
    std::copy_n(from + first, count, to);
    // Lanes without a ray are switched off below.
    std::fill(to + count, to + packet_size, 0.0);
  }
  std::fill_n(packet.t, packet_size, infinity);
  if (rays.t_max != nullptr) std::copy_n(rays.t_max + first, count, packet.t);
  std::fill_n(packet.geometry, packet_size, PrimitiveRef::none);
  std::fill_n(packet.primitive, packet_size, PrimitiveRef::none);
  std::fill_n(packet.from_geometry, packet_size, PrimitiveRef::none);
  std::fill_n(packet.from_primitive, packet_size, PrimitiveRef::none);
  for (int i = 0; rays.from != nullptr && i < count; ++i) {
    packet.from_geometry[i] = rays.from[first + i].geometry;
    packet.from_primitive[i] = rays.from[first + i].primitive;
  }
  for (int i = 0; i < packet_size; ++i) {
    const double ox = packet.ox[i], oy = packet.oy[i], oz = packet.oz[i];
    const double dx = packet.dx[i], dy = packet.dy[i], dz = packet.dz[i];
    // Slab test (Kay & Kajiya 1986); comparisons are ordered so that 0/0 on a slab's plane is ignored.
    const double ix = 1 / dx, iy = 1 / dy, iz = 1 / dz;
    const double ax = (box.low.x - ox) * ix, bx = (box.high.x - ox) * ix;
    const double ay = (box.low.y - oy) * iy, by = (box.high.y - oy) * iy;
    const double az = (box.low.z - oz) * iz, bz = (box.high.z - oz) * iz;
    double enter = 0, leave = packet.t[i];
    enter = (ax < bx ? ax : bx) > enter ? (ax < bx ? ax : bx) : enter;
    enter = (ay < by ? ay : by) > enter ? (ay < by ? ay : by) : enter;
    enter = (az < bz ? az : bz) > enter ? (az < bz ? az : bz) : enter;
    leave = (ax > bx ? ax : bx) < leave ? (ax > bx ? ax : bx) : leave;
    leave = (ay > by ? ay : by) < leave ? (ay > by ? ay : by) : leave;
    leave = (az > bz ? az : bz) < leave ? (az > bz ? az : bz) : leave;
    const double doubt = float_slack + enter * 0x1p-48;  // the slabs' rounding grows with the distance
    const double start = enter - doubt;
    const bool finite = (ox + oy + oz + dx + dy + dz) * 0 == 0;
    packet.start[i] = start;
    packet.reach[i] = reach_of(leave + doubt, start);
    packet.active[i] = (i < count) & finite & (start <= leave) & (enter < distance_max) ? -1 : 0;
  }
  int along_x = 0, along_y = 0, active = 0;
  for (int i = 0; i < packet_size; ++i) {
    const bool x = x_leads(packet.dx[i], packet.dy[i], packet.dz[i]);
    along_x += x ? packet.active[i] : 0;
    along_y += !x & y_leads(packet.dy[i], packet.dz[i]) ? packet.active[i] : 0;
    active += packet.active[i];
  }
  packet.leading = along_x == active        ? LeadingAxis::x
                   : along_y == active      ? LeadingAxis::y
                   : along_x + along_y == 0 ? LeadingAxis::z
                                            : LeadingAxis::mixed;
}

WHITTLE_WIDE void write_rays(const Packet& packet, unsigned mask, RTCRay16& ray) {
  for (int i = 0; i < packet_size; ++i) {
    const bool active = packet.active[i] != 0;
    // Inactive lanes get harmless numbers: this Embree asserts on a NaN even there.
    ray.org_x[i] = active ? static_cast<float>(packet.ox[i] + packet.start[i] * packet.dx[i]) : 0.0f;
    ray.org_y[i] = active ? static_cast<float>(packet.oy[i] + packet.start[i] * packet.dy[i]) : 0.0f;
    ray.org_z[i] = active ? static_cast<float>(packet.oz[i] + packet.start[i] * packet.dz[i]) : 0.0f;
    ray.dir_x[i] = active ? static_cast<float>(packet.dx[i]) : 0.0f;
    ray.dir_y[i] = active ? static_cast<float>(packet.dy[i]) : 0.0f;
    ray.dir_z[i] = active ? static_cast<float>(packet.dz[i]) : 1.0f;
    ray.tnear[i] = 0;
    ray.tfar[i] = active ? packet.reach[i] : 0.0f;
    ray.time[i] = 0;
    ray.mask[i] = mask;
    ray.id[i] = static_cast<unsigned>(i);
    ray.flags[i] = 0;
  }
}

WHITTLE_WIDE void closest(Packet& packet, Asked asked, const int* valid, float* tfar, const SphereGeometry& geometry,
                          PrimitiveRef self) {
  const SphereTest sphere = sphere_test(geometry, self.primitive);
  const int first = first_lane(asked);
  for_lanes(
      asked, [&](int i) __attribute__((always_inline)) {
        const double t =
            sphere_distance(packet.ox[i], packet.oy[i], packet.oz[i], packet.dx[i], packet.dy[i], packet.dz[i], sphere);
        const bool nearer =
            (valid[i - first] != 0) & wins(t, self, packet.t[i], packet.geometry[i], packet.primitive[i]);
        packet.t[i] = nearer ? t : packet.t[i];
        packet.geometry[i] = nearer ? self.geometry : packet.geometry[i];
        packet.primitive[i] = nearer ? self.primitive : packet.primitive[i];
        tfar[i - first] = nearer ? reach_of(t, packet.start[i]) : tfar[i - first];
      });
}

WHITTLE_WIDE void occluded(const Packet& packet, Asked asked, const int* valid, float* tfar,
                           const SphereGeometry& geometry, PrimitiveRef self) {
  const SphereTest sphere = sphere_test(geometry, self.primitive);
  const int first = first_lane(asked);
  for_lanes(
      asked, [&](int i) __attribute__((always_inline)) {
        const double t =
            sphere_distance(packet.ox[i], packet.oy[i], packet.oz[i], packet.dx[i], packet.dy[i], packet.dz[i], sphere);
        const bool blocked = (valid[i - first] != 0) & (t < packet.t[i]);
        tfar[i - first] = blocked ? -std::numeric_limits<float>::infinity() : tfar[i - first];
      });
}

void closest_lane(Packet& packet, unsigned lane, float& tfar, const SphereGeometry& geometry, PrimitiveRef self) {
  const SphereTest sphere = sphere_test(geometry, self.primitive);
  const double t = sphere_distance(packet.ox[lane], packet.oy[lane], packet.oz[lane], packet.dx[lane], packet.dy[lane],
                                   packet.dz[lane], sphere);
  if (!wins(t, self, packet.t[lane], packet.geometry[lane], packet.primitive[lane])) return;
  packet.t[lane] = t;
  packet.geometry[lane] = self.geometry;
  packet.primitive[lane] = self.primitive;
  tfar = reach_of(t, packet.start[lane]);
}

void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const SphereGeometry& geometry,
                   PrimitiveRef self) {
  const SphereTest sphere = sphere_test(geometry, self.primitive);
  const double t = sphere_distance(packet.ox[lane], packet.oy[lane], packet.oz[lane], packet.dx[lane], packet.dy[lane],
                                   packet.dz[lane], sphere);
  if (t < packet.t[lane]) tfar = -std::numeric_limits<float>::infinity();
}

WHITTLE_WIDE void closest_planes(Packet& packet, int count, const PlaneGeometry& planes, std::uint32_t geometry,
                                 Among among) {
  for (std::size_t k = 0; k < planes.point.size(); ++k) {
    if (among != Among::all && (planes.transmissive[k] != 0) != (among == Among::transmissive)) continue;
    const Vec3 point = planes.point[k], normal = planes.normal[k];
    const PrimitiveRef self{geometry, static_cast<std::uint32_t>(k)};
    for (int i = 0; i < packet_size; ++i) {
      const double height = (point.x - packet.ox[i]) * normal.x + (point.y - packet.oy[i]) * normal.y +
                            (point.z - packet.oz[i]) * normal.z;
      const double slope = packet.dx[i] * normal.x + packet.dy[i] * normal.y + packet.dz[i] * normal.z;
      const double t = height / slope;
      const bool nearer = (i < count) & (t > 0) & (t < std::numeric_limits<double>::max()) &
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

WHITTLE_WIDE void occluded_planes(const Packet& packet, int count, const PlaneGeometry& planes, std::uint32_t geometry,
                                  std::uint8_t* blocked) {
  for (std::size_t k = 0; k < planes.point.size(); ++k) {
    if (planes.transmissive[k] != 0) continue;
    const Vec3 point = planes.point[k], normal = planes.normal[k];
    const PrimitiveRef self{geometry, static_cast<std::uint32_t>(k)};
    std::uint8_t met[packet_size];
    for (int i = 0; i < packet_size; ++i) {
      const double height = (point.x - packet.ox[i]) * normal.x + (point.y - packet.oy[i]) * normal.y +
                            (point.z - packet.oz[i]) * normal.z;
      const double slope = packet.dx[i] * normal.x + packet.dy[i] * normal.y + packet.dz[i] * normal.z;
      const double t = height / slope;
      met[i] = !starts_on(packet, static_cast<unsigned>(i), self) & (t > 0) & (t < packet.t[i]) &
               (t < std::numeric_limits<double>::max());
    }
    for (int i = 0; i < count; ++i) blocked[i] |= met[i];
  }
}

}  // namespace tracer
