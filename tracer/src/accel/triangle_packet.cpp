#include "tracer/src/accel/packet.h"
#include "tracer/src/accel/triangle_hit.h"

namespace tracer {
namespace {

WHITTLE_INLINE TriangleHit lane_hit(const Packet& p, int i, const TriangleTest& triangle) {
  return watertight_hit(triangle, seen_along(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]));
}

}  // namespace

WHITTLE_WIDE void closest(Packet& packet, const int* valid, float* tfar, const TriangleGeometry& geometry,
                          PrimitiveRef self) {
  const TriangleTest triangle = triangle_test(geometry, self.primitive);
  for (int i = 0; i < packet_size; ++i) {
    const TriangleHit hit = lane_hit(packet, i, triangle);
    const bool nearer = (valid[i] != 0) & !starts_on(packet, static_cast<unsigned>(i), self) &
                        wins(hit.t, self, packet.t[i], packet.geometry[i], packet.primitive[i]);
    packet.t[i] = nearer ? hit.t : packet.t[i];
    packet.u[i] = nearer ? hit.u : packet.u[i];
    packet.v[i] = nearer ? hit.v : packet.v[i];
    packet.geometry[i] = nearer ? self.geometry : packet.geometry[i];
    packet.primitive[i] = nearer ? self.primitive : packet.primitive[i];
    tfar[i] = nearer ? reach_of(hit.t, packet.start[i]) : tfar[i];
  }
}

WHITTLE_WIDE void occluded(const Packet& packet, const int* valid, float* tfar, const TriangleGeometry& geometry,
                           PrimitiveRef self) {
  const TriangleTest triangle = triangle_test(geometry, self.primitive);
  for (int i = 0; i < packet_size; ++i) {
    const TriangleHit hit = lane_hit(packet, i, triangle);
    const bool blocked = (valid[i] != 0) & !starts_on(packet, static_cast<unsigned>(i), self) & (hit.t < packet.t[i]);
    tfar[i] = blocked ? -std::numeric_limits<float>::infinity() : tfar[i];
  }
}

void closest_lane(Packet& packet, unsigned lane, float& tfar, const TriangleGeometry& geometry, PrimitiveRef self) {
  if (starts_on(packet, lane, self)) return;
  const TriangleHit hit = lane_hit(packet, static_cast<int>(lane), triangle_test(geometry, self.primitive));
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
  if (lane_hit(packet, static_cast<int>(lane), triangle_test(geometry, self.primitive)).t < packet.t[lane])
    tfar = -std::numeric_limits<float>::infinity();
}

}  // namespace tracer
