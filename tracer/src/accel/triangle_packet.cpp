#include <type_traits>

#include "tracer/src/accel/packet.h"
#include "tracer/src/accel/triangle_hit.h"

namespace tracer {
namespace {

/// Runs `with(ray_of)` with the code that fits how the packet's rays go: where all lead along one axis, which is which
/// is decided once and not by each lane.
template <class With>
WHITTLE_INLINE auto by_leading(const Packet& p, const With& with) {
  const auto along = [&](auto along_x, auto along_y) __attribute__((always_inline)) {
    return with([&](int i) __attribute__((always_inline)) {
      return seen_along(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i], along_x.value, along_y.value);
    });
  };
  switch (p.leading) {
    case DominantAxis::x:
      return along(std::true_type{}, std::false_type{});
    case DominantAxis::y:
      return along(std::false_type{}, std::true_type{});
    case DominantAxis::z:
      return along(std::false_type{}, std::false_type{});
    case DominantAxis::mixed:
      break;
  }
  return with([&](int i) __attribute__((always_inline)) {
    return seen_along(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]);
  });
}

/// Which triangles of a run any of the lanes that count may meet, and does not start on.
template <bool pair, int count>
WHITTLE_INLINE int any_may_hit(const Packet& p, int first_lane, const int* valid, RTCRayN* rays,
                               const TrianglePairBounds& run) {
  const float *ox = &RTCRayN_org_x(rays, count, 0), *dx = &RTCRayN_dir_x(rays, count, 0);
  const float *oy = &RTCRayN_org_y(rays, count, 0), *dy = &RTCRayN_dir_y(rays, count, 0);
  const float *oz = &RTCRayN_org_z(rays, count, 0), *dz = &RTCRayN_dir_z(rays, count, 0);
  const float* error_bound = p.error_bound + first_lane;
  const std::uint32_t* from_geometry = p.from_geometry + first_lane;
  const std::uint32_t* from_primitive = p.from_primitive + first_lane;
  const TrianglePairBounds corners = run;
  const float float_bound = run.longest * p.float_bound;
  int met = 0;
  for (int k = 0; k < count; ++k) {
    const int may = may_hit<pair>(corners, {ox[k], oy[k], oz[k]}, {dx[k], dy[k], dz[k]}, float_bound + error_bound[k]);
    const bool on_first = (from_geometry[k] == corners.geometry) & (from_primitive[k] == corners.triangles.first);
    const bool on_second = (from_geometry[k] == corners.geometry) & (from_primitive[k] == corners.triangles.second);
    met |= may & (on_first ? ~first_triangle : ~0) & (on_second ? ~second_triangle : ~0) & valid[k];
  }
  return met;
}

template <bool pair>
WHITTLE_INLINE int any_may_hit(const Packet& p, Asked asked, const int* valid, RTCRayN* rays,
                               const TrianglePairBounds& run) {
  if (asked == Asked::whole) return any_may_hit<pair, packet_size>(p, 0, valid, rays, run);
  return any_may_hit<pair, half_packet>(p, asked == Asked::first_half ? 0 : half_packet, valid, rays, run);
}

WHITTLE_INLINE int any_may_hit(const Packet& p, Asked asked, const int* valid, RTCRayN* rays,
                               const TrianglePairBounds& run) {
  return run.pair() ? any_may_hit<true>(p, asked, valid, rays, run) : any_may_hit<false>(p, asked, valid, rays, run);
}

/// Runs `take(lane, place, hit)` over the lanes asked about.
template <class Take>
WHITTLE_INLINE void for_each_hit(const Packet& p, Asked asked, const int* valid, const TriangleTest& triangle,
                                 const Take& take) {
  by_leading(
      p, [&](const auto& ray_of) __attribute__((always_inline)) {
        for_lanes(
            asked, [&](int i, int k) __attribute__((always_inline)) {
              const RayShear ray = ray_of(i);
              ShearedTriangle s = seen(ray, triangle);
              s.inside = s.inside & (valid[k] != 0);
              take(i, k, watertight_hit(s, ray.dz));
            });
      });
}

TriangleHit lane_hit(const Packet& p, unsigned i, const TriangleTest& triangle) {
  const RayShear ray = seen_along(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]);
  const ShearedTriangle s = seen(ray, triangle);
  return s.inside ? watertight_hit(s, ray.dz) : TriangleHit{};
}

// Functions of their own: where the compiler sees two triangles at once it makes no vector code of these loops.

WHITTLE_WIDE void take_closest(Packet& packet, Asked asked, const int* valid, float* __restrict tfar,
                               const TriangleGeometry& geometry, PrimitiveRef self) {
  for_each_hit(
      packet, asked, valid, triangle_test(geometry, self.primitive),
      [&](int i, int k, const TriangleHit& hit) __attribute__((always_inline)) {
        const bool nearer = !starts_on(packet, static_cast<unsigned>(i), self) &
                            wins(hit.t, self, packet.t[i], packet.geometry[i], packet.primitive[i]);
        packet.t[i] = nearer ? hit.t : packet.t[i];
        packet.u[i] = nearer ? hit.u : packet.u[i];
        packet.v[i] = nearer ? hit.v : packet.v[i];
        packet.geometry[i] = nearer ? self.geometry : packet.geometry[i];
        packet.primitive[i] = nearer ? self.primitive : packet.primitive[i];
        tfar[k] = nearer ? reach_of(hit.t, packet.start[i]) : tfar[k];
      });
}

WHITTLE_WIDE void take_blocked(const Packet& packet, Asked asked, const int* valid, float* __restrict tfar,
                               const TriangleGeometry& geometry, PrimitiveRef self) {
  for_each_hit(
      packet, asked, valid, triangle_test(geometry, self.primitive),
      [&](int i, int k, const TriangleHit& hit) __attribute__((always_inline)) {
        const bool blocked = !starts_on(packet, static_cast<unsigned>(i), self) & (hit.t < packet.t[i]);
        tfar[k] = blocked ? -std::numeric_limits<float>::infinity() : tfar[k];
      });
}

float* tfar_of(RTCRayN* rays, Asked asked) {
  return &RTCRayN_tfar(rays, asked == Asked::whole ? packet_size : half_packet, 0);
}

}  // namespace

WHITTLE_WIDE void intersect(Packet& packet, Asked asked, const int* valid, RTCRayN* rays,
                            const TriangleGeometry& geometry, const TrianglePairBounds& run) {
  const int met = any_may_hit(packet, asked, valid, rays, run);
  if (met == 0) [[likely]]
    return;
  const PrimitiveRef first{run.geometry, run.triangles.first}, second{run.geometry, run.triangles.second};
  if ((met & first_triangle) != 0) take_closest(packet, asked, valid, tfar_of(rays, asked), geometry, first);
  if ((met & second_triangle) != 0) take_closest(packet, asked, valid, tfar_of(rays, asked), geometry, second);
}

WHITTLE_WIDE void occluded(const Packet& packet, Asked asked, const int* valid, RTCRayN* rays,
                           const TriangleGeometry& geometry, const TrianglePairBounds& run) {
  const int met = any_may_hit(packet, asked, valid, rays, run);
  if (met == 0) [[likely]]
    return;
  const PrimitiveRef first{run.geometry, run.triangles.first}, second{run.geometry, run.triangles.second};
  if ((met & first_triangle) != 0) take_blocked(packet, asked, valid, tfar_of(rays, asked), geometry, first);
  if ((met & second_triangle) != 0) take_blocked(packet, asked, valid, tfar_of(rays, asked), geometry, second);
}

void closest_lane(Packet& packet, unsigned lane, float& tfar, const TriangleGeometry& geometry, PrimitiveRef self) {
  if (starts_on(packet, lane, self)) return;
  const TriangleHit hit = lane_hit(packet, lane, triangle_test(geometry, self.primitive));
  if (!wins(hit.t, self, packet.t[lane], packet.geometry[lane], packet.primitive[lane])) return;
  packet.t[lane] = hit.t;
  packet.u[lane] = hit.u;
  packet.v[lane] = hit.v;
  packet.geometry[lane] = self.geometry;
  packet.primitive[lane] = self.primitive;
  tfar = reach_of(hit.t, packet.start[lane]);
}

void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const TriangleGeometry& geometry,
                   PrimitiveRef self) {
  if (starts_on(packet, lane, self)) return;
  if (lane_hit(packet, lane, triangle_test(geometry, self.primitive)).t < packet.t[lane])
    tfar = -std::numeric_limits<float>::infinity();
}

}  // namespace tracer
