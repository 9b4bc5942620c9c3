#include <type_traits>

#include "tracer/src/accel/packet.h"
#include "tracer/src/accel/triangle_hit.h"

namespace tracer {
namespace {

/// The lanes' SeenTriangle.
struct alignas(64) SeenLanes {
  double at_a[packet_size], at_b[packet_size], at_c[packet_size];
  double depth_a[packet_size], depth_b[packet_size], depth_c[packet_size];
  double along[packet_size];  ///< the ray's largest component
  int inside[packet_size];    ///< and the lane is valid
};

template <class RayOf>
WHITTLE_INLINE void see(Asked asked, const int* valid, const TriangleTest& triangle, SeenLanes& lanes_see,
                        const RayOf& ray_of) {
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        const SeenAlong ray = ray_of(i);
        const SeenTriangle s = seen(ray, triangle);
        lanes_see.at_a[i] = s.at_a;
        lanes_see.at_b[i] = s.at_b;
        lanes_see.at_c[i] = s.at_c;
        lanes_see.depth_a[i] = s.depth_a;
        lanes_see.depth_b[i] = s.depth_b;
        lanes_see.depth_c[i] = s.depth_c;
        lanes_see.along[i] = ray.dz;
        lanes_see.inside[i] = s.inside ? valid[k] : 0;
      });
}

/// Whether any of the lanes that count meets the triangle: few of those that Embree proposes do, and only these pay for
/// divisions.
WHITTLE_INLINE bool any_sees(const Packet& p, Asked asked, const int* valid, const TriangleTest& triangle,
                             SeenLanes& lanes_see) {
  const auto along = [&](auto along_x, auto along_y) __attribute__((always_inline)) {
    see(
        asked, valid, triangle, lanes_see, [&](int i) __attribute__((always_inline)) {
          return seen_along(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i], along_x.value, along_y.value);
        });
  };
  switch (p.leading) {
    case LeadingAxis::x:
      along(std::true_type{}, std::false_type{});
      break;
    case LeadingAxis::y:
      along(std::false_type{}, std::true_type{});
      break;
    case LeadingAxis::z:
      along(std::false_type{}, std::false_type{});
      break;
    case LeadingAxis::mixed:
      see(
          asked, valid, triangle, lanes_see, [&](int i) __attribute__((always_inline)) {
            return seen_along(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]);
          });
      break;
  }
  int met = 0;
  for_lanes(
      asked, [&](int i, int /*place*/) __attribute__((always_inline)) { met |= lanes_see.inside[i]; });
  return met != 0;
}

WHITTLE_INLINE TriangleHit hit_of(const SeenLanes& s, int i) {
  return watertight_hit({s.at_a[i], s.at_b[i], s.at_c[i], s.depth_a[i], s.depth_b[i], s.depth_c[i], s.inside[i] != 0},
                        s.along[i]);
}

TriangleHit lane_hit(const Packet& p, unsigned i, const TriangleTest& triangle) {
  const SeenAlong ray = seen_along(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]);
  const SeenTriangle s = seen(ray, triangle);
  return s.inside ? watertight_hit(s, ray.dz) : TriangleHit{};
}

}  // namespace

WHITTLE_WIDE void closest(Packet& packet, Asked asked, const int* valid, float* __restrict tfar,
                          const TriangleGeometry& geometry, PrimitiveRef self) {
  SeenLanes lanes_see;
  if (!any_sees(packet, asked, valid, triangle_test(geometry, self.primitive), lanes_see)) return;
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        const TriangleHit hit = hit_of(lanes_see, i);
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

WHITTLE_WIDE void occluded(const Packet& packet, Asked asked, const int* valid, float* __restrict tfar,
                           const TriangleGeometry& geometry, PrimitiveRef self) {
  SeenLanes lanes_see;
  if (!any_sees(packet, asked, valid, triangle_test(geometry, self.primitive), lanes_see)) return;
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        const TriangleHit hit = hit_of(lanes_see, i);
        const bool blocked = !starts_on(packet, static_cast<unsigned>(i), self) & (hit.t < packet.t[i]);
        tfar[k] = blocked ? -std::numeric_limits<float>::infinity() : tfar[k];
      });
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
