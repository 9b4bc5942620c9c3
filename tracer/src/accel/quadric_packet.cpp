#include "tracer/src/accel/packet.h"
#include "tracer/src/shapes/registry.h"

namespace tracer {
namespace {

/// The lanes' rays in the shape's space.
struct alignas(64) ShapeRays {
  double ox[packet_size], oy[packet_size], oz[packet_size];
  double dx[packet_size], dy[packet_size], dz[packet_size];
  [[nodiscard]] WHITTLE_INLINE ShapeRay of(int i) const { return {ox[i], oy[i], oz[i], dx[i], dy[i], dz[i]}; }
};

/// Whether any valid lane may hit the shape: only these pay for exact sums and quotients.
template <class Standard>
WHITTLE_INLINE bool any_may_hit(const ShapeRays& rays, Asked asked, const int* valid, const Quadric& quadric) {
  const double radius_0 = quadric.radius_0, radius_1 = quadric.radius_1;
  int may = 0;
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        may |= Standard::may_hit(rays.of(i), radius_0, radius_1) ? valid[k] : 0;
      });
  return may != 0;
}

/// QuadricHit of each lane.
struct alignas(64) QuadricHits {
  double t[packet_size], part[packet_size];
};

template <bool scalar, class HitOf>
WHITTLE_INLINE void intersect_lanes(const ShapeRays& rays, Asked asked, const int* valid, QuadricHits& hits,
                                    const HitOf& hit_of) {
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        const QuadricHit hit = scalar && valid[k] == 0 ? QuadricHit{} : hit_of(rays.of(i));
        hits.t[i] = hit.t;
        hits.part[i] = hit.part;
      });
}

/// Fills the hits of the requested lanes; false where no valid lane hits the shape. The kind is decided once, outside
/// the loop.
WHITTLE_INLINE bool any_hit(const Packet& p, Asked asked, const int* valid, const Quadric& quadric, QuadricHits& hits) {
  ShapeRays rays;
  for_lanes(
      asked, [&](int i, int /*place*/) __attribute__((always_inline)) {
        const ShapeRay ray = shape_ray(quadric, p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]);
        rays.ox[i] = ray.ox;
        rays.oy[i] = ray.oy;
        rays.oz[i] = ray.oz;
        rays.dx[i] = ray.dx;
        rays.dy[i] = ray.dy;
        rays.dz[i] = ray.dz;
      });
  bool any = true;
  visit_kind(
      quadric.kind, [&](auto standard) __attribute__((always_inline)) {
        using Standard = decltype(standard);
        if constexpr (Standard::culls) {
          any = any_may_hit<Standard>(rays, asked, valid, quadric);
          if (!any) return;
        }
        Standard::with_hit(
            quadric, [&](const auto& hit_of) __attribute__((always_inline)) {
              intersect_lanes<Standard::scalar>(rays, asked, valid, hits, hit_of);
            });
      });
  return any;
}

/// The place of the one lane that counts, or less than 0 where there are more. Embree goes on with rays one by one
/// where few of a packet are together: two thirds of what it asks of a lattice of mirrors.
WHITTLE_INLINE int only_place(Asked asked, const int* valid) {
  int counting = 0, place = 0;
  for_lanes(
      asked, [&](int /*i*/, int k) __attribute__((always_inline)) {
        counting += valid[k];
        place |= valid[k] & k;
      });
  return counting == -1 ? place : -1;
}

WHITTLE_INLINE QuadricHit lane_hit(const Packet& p, unsigned i, const Quadric& quadric) {
  return quadric_hit(quadric, shape_ray(quadric, p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]));
}

WHITTLE_INLINE void take_closest(Packet& packet, unsigned lane, float& tfar, const QuadricGeometry& geometry,
                                 PrimitiveRef self) {
  const QuadricHit hit = lane_hit(packet, lane, geometry.quadrics[self.primitive]);
  if (!(hit.t < std::numeric_limits<double>::infinity()) ||
      !wins(hit.t, self, packet.t[lane], packet.geometry[lane], packet.primitive[lane]))
    return;
  packet.t[lane] = hit.t;
  packet.u[lane] = hit.part;
  packet.geometry[lane] = self.geometry;
  packet.primitive[lane] = self.primitive;
  tfar = reach_of(hit.t, packet.start[lane]);
}

}  // namespace

// Wide for their exact products too, which are calls of the library where the instruction set knows none.

WHITTLE_WIDE void closest_lane(Packet& packet, unsigned lane, float& tfar, const QuadricGeometry& geometry,
                               PrimitiveRef self) {
  take_closest(packet, lane, tfar, geometry, self);
}

WHITTLE_WIDE void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const QuadricGeometry& geometry,
                                PrimitiveRef self) {
  if (lane_hit(packet, lane, geometry.quadrics[self.primitive]).t < packet.t[lane])
    tfar = -std::numeric_limits<float>::infinity();
}

WHITTLE_WIDE void intersect(Packet& packet, Asked asked, const int* valid, float* __restrict tfar,
                            const QuadricGeometry& geometry, PrimitiveRef self) {
  if (const int only = only_place(asked, valid); only >= 0) {
    const int lane = asked == Asked::second_half ? half_packet + only : only;
    take_closest(packet, static_cast<unsigned>(lane), tfar[only], geometry, self);
    return;
  }
  QuadricHits hits;
  if (!any_hit(packet, asked, valid, geometry.quadrics[self.primitive], hits)) return;
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        const double t = hits.t[i];
        const bool nearer = (valid[k] != 0) & (t < std::numeric_limits<double>::infinity()) &
                            wins(t, self, packet.t[i], packet.geometry[i], packet.primitive[i]);
        packet.t[i] = nearer ? t : packet.t[i];
        packet.u[i] = nearer ? hits.part[i] : packet.u[i];
        packet.geometry[i] = nearer ? self.geometry : packet.geometry[i];
        packet.primitive[i] = nearer ? self.primitive : packet.primitive[i];
        tfar[k] = nearer ? reach_of(t, packet.start[i]) : tfar[k];
      });
}

WHITTLE_WIDE void occluded(const Packet& packet, Asked asked, const int* valid, float* __restrict tfar,
                           const QuadricGeometry& geometry, PrimitiveRef self) {
  QuadricHits hits;
  if (!any_hit(packet, asked, valid, geometry.quadrics[self.primitive], hits)) return;
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        const bool blocked = (valid[k] != 0) & (hits.t[i] < packet.t[i]);
        tfar[k] = blocked ? -std::numeric_limits<float>::infinity() : tfar[k];
      });
}

}  // namespace tracer
