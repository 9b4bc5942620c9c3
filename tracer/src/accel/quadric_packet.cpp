#include "tracer/src/accel/packet.h"
#include "tracer/src/accel/quadric_hit.h"

namespace tracer {
namespace {

/// Runs `take(lane, hit)` over the lanes. The kind is decided once, outside the loop.
template <class Take>
WHITTLE_INLINE void for_each_lane(const Packet& p, const Quadric& quadric, const Take& take) {
  const auto lanes = [&](const auto& hit_of) __attribute__((always_inline)) {
    for (int i = 0; i < packet_size; ++i)
      take(i, hit_of(shape_ray(quadric, p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i])));
  };
  switch (quadric.kind) {
    case QuadricKind::ellipsoid:
      return lanes([](const ShapeRay& ray) __attribute__((always_inline)) { return ellipsoid_hit(ray); });
    case QuadricKind::disc:
      return lanes([&](const ShapeRay& ray) __attribute__((always_inline)) { return disc_hit(ray, quadric.radius_0); });
    case QuadricKind::frustum:
      return lanes([&](const ShapeRay& ray) __attribute__((always_inline)) {
        return frustum_hit(ray, quadric.radius_0, quadric.radius_1, quadric.caps);
      });
    case QuadricKind::box:
      return lanes([](const ShapeRay& ray) __attribute__((always_inline)) { return box_hit(ray); });
  }
}

WHITTLE_INLINE QuadricHit lane_hit(const Packet& p, unsigned i, const Quadric& quadric) {
  return quadric_hit(quadric, shape_ray(quadric, p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]));
}

}  // namespace

WHITTLE_WIDE void closest(Packet& packet, const int* valid, float* tfar, const QuadricGeometry& geometry,
                          PrimitiveRef self) {
  for_each_lane(
      packet, geometry.quadrics[self.primitive], [&](int i, const QuadricHit& hit) __attribute__((always_inline)) {
        const bool nearer = (valid[i] != 0) & (hit.t < std::numeric_limits<double>::infinity()) &
                            wins(hit.t, self, packet.t[i], packet.geometry[i], packet.primitive[i]);
        packet.t[i] = nearer ? hit.t : packet.t[i];
        packet.u[i] = nearer ? hit.part : packet.u[i];
        packet.geometry[i] = nearer ? self.geometry : packet.geometry[i];
        packet.primitive[i] = nearer ? self.primitive : packet.primitive[i];
        tfar[i] = nearer ? reach_of(hit.t, packet.start[i]) : tfar[i];
      });
}

WHITTLE_WIDE void occluded(const Packet& packet, const int* valid, float* tfar, const QuadricGeometry& geometry,
                           PrimitiveRef self) {
  for_each_lane(
      packet, geometry.quadrics[self.primitive], [&](int i, const QuadricHit& hit) __attribute__((always_inline)) {
        const bool blocked = (valid[i] != 0) & (hit.t < packet.t[i]);
        tfar[i] = blocked ? -std::numeric_limits<float>::infinity() : tfar[i];
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
