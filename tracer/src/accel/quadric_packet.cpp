#include "tracer/src/accel/packet.h"
#include "tracer/src/accel/quadric_hit.h"

namespace tracer {
namespace {

/// Runs `take(lane, place in valid and tfar, hit)` over the lanes asked about. The kind is decided once, outside the
/// loop.
template <class Take>
WHITTLE_INLINE void for_each_lane(const Packet& p, Asked asked, const Quadric& quadric, const Take& take) {
  const auto all = [&](const auto& hit_of) __attribute__((always_inline)) {
    const int first = first_lane(asked);
    for_lanes(
        asked, [&](int i) __attribute__((always_inline)) {
          take(i, i - first, hit_of(shape_ray(quadric, p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i])));
        });
  };
  switch (quadric.kind) {
    case QuadricKind::ellipsoid:
      return all([](const ShapeRay& ray) __attribute__((always_inline)) { return ellipsoid_hit(ray); });
    case QuadricKind::disc:
      return all([&](const ShapeRay& ray) __attribute__((always_inline)) { return disc_hit(ray, quadric.radius_0); });
    case QuadricKind::frustum:
      return all([&](const ShapeRay& ray) __attribute__((always_inline)) {
        return frustum_hit(ray, quadric.radius_0, quadric.radius_1, quadric.caps);
      });
    case QuadricKind::box:
      return all([](const ShapeRay& ray) __attribute__((always_inline)) { return box_hit(ray); });
  }
}

WHITTLE_INLINE QuadricHit lane_hit(const Packet& p, unsigned i, const Quadric& quadric) {
  return quadric_hit(quadric, shape_ray(quadric, p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]));
}

}  // namespace

WHITTLE_WIDE void closest(Packet& packet, Asked asked, const int* valid, float* tfar, const QuadricGeometry& geometry,
                          PrimitiveRef self) {
  for_each_lane(
      packet, asked,
      geometry.quadrics[self.primitive], [&](int i, int k, const QuadricHit& hit) __attribute__((always_inline)) {
        const bool nearer = (valid[k] != 0) & (hit.t < std::numeric_limits<double>::infinity()) &
                            wins(hit.t, self, packet.t[i], packet.geometry[i], packet.primitive[i]);
        packet.t[i] = nearer ? hit.t : packet.t[i];
        packet.u[i] = nearer ? hit.part : packet.u[i];
        packet.geometry[i] = nearer ? self.geometry : packet.geometry[i];
        packet.primitive[i] = nearer ? self.primitive : packet.primitive[i];
        tfar[k] = nearer ? reach_of(hit.t, packet.start[i]) : tfar[k];
      });
}

WHITTLE_WIDE void occluded(const Packet& packet, Asked asked, const int* valid, float* tfar,
                           const QuadricGeometry& geometry, PrimitiveRef self) {
  for_each_lane(
      packet, asked,
      geometry.quadrics[self.primitive], [&](int i, int k, const QuadricHit& hit) __attribute__((always_inline)) {
        const bool blocked = (valid[k] != 0) & (hit.t < packet.t[i]);
        tfar[k] = blocked ? -std::numeric_limits<float>::infinity() : tfar[k];
      });
}

// Wide for their exact products, which are calls of the library where the instruction set knows none.
WHITTLE_WIDE void closest_lane(Packet& packet, unsigned lane, float& tfar, const QuadricGeometry& geometry,
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

WHITTLE_WIDE void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const QuadricGeometry& geometry,
                                PrimitiveRef self) {
  if (lane_hit(packet, lane, geometry.quadrics[self.primitive]).t < packet.t[lane])
    tfar = -std::numeric_limits<float>::infinity();
}

}  // namespace tracer
