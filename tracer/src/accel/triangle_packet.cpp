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
    case LeadingAxis::x:
      return along(std::true_type{}, std::false_type{});
    case LeadingAxis::y:
      return along(std::false_type{}, std::true_type{});
    case LeadingAxis::z:
      return along(std::false_type{}, std::false_type{});
    case LeadingAxis::mixed:
      break;
  }
  return with([&](int i) __attribute__((always_inline)) {
    return seen_along(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]);
  });
}

/// Which triangles of a run any of the lanes that count meets.
struct Met {
  bool first, second;
};

template <class RayOf>
WHITTLE_INLINE Met any_sees(Asked asked, const int* valid, const TriangleTest& triangle, const RayOf& ray_of) {
  int met = 0;
  for_lanes(
      asked, [&](int i, int k)
                 __attribute__((always_inline)) { met |= seen(ray_of(i), triangle).inside ? valid[k] : 0; });
  return {met != 0, false};
}

template <class RayOf>
WHITTLE_INLINE Met any_sees(Asked asked, const int* valid, const PairTest& pair, const RayOf& ray_of) {
  int first = 0, second = 0;
  for_lanes(
      asked, [&](int i, int k) __attribute__((always_inline)) {
        const SeenPair met = seen(ray_of(i), pair);
        const int counts = valid[k];
        first |= met.first >= 0 ? counts : 0;
        second |= met.second >= 0 ? counts : 0;
      });
  return {first != 0, second != 0};
}

WHITTLE_INLINE Met any_sees(const Packet& p, Asked asked, const int* valid, const TriangleGeometry& geometry,
                            TriangleRun run) {
  const auto sees = [&](const auto& test) __attribute__((always_inline)) {
    return by_leading(
        p, [&](const auto& ray_of) __attribute__((always_inline)) { return any_sees(asked, valid, test, ray_of); });
  };
  const std::uint32_t first = run.first.primitive;
  return run.pair ? sees(pair_test(geometry, first)) : sees(triangle_test(geometry, first));
}

/// Runs `take(lane, place, hit)` over the lanes asked about.
template <class Take>
WHITTLE_INLINE void for_each_hit(const Packet& p, Asked asked, const int* valid, const TriangleTest& triangle,
                                 const Take& take) {
  by_leading(
      p, [&](const auto& ray_of) __attribute__((always_inline)) {
        for_lanes(
            asked, [&](int i, int k) __attribute__((always_inline)) {
              const SeenAlong ray = ray_of(i);
              SeenTriangle s = seen(ray, triangle);
              s.inside = s.inside & (valid[k] != 0);
              take(i, k, watertight_hit(s, ray.dz));
            });
      });
}

TriangleHit lane_hit(const Packet& p, unsigned i, const TriangleTest& triangle) {
  const SeenAlong ray = seen_along(p.ox[i], p.oy[i], p.oz[i], p.dx[i], p.dy[i], p.dz[i]);
  const SeenTriangle s = seen(ray, triangle);
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

}  // namespace

// Few of the triangles that Embree proposes are met: all is computed anew for these, which takes less than to store for
// each what it may need.

WHITTLE_WIDE void closest(Packet& packet, Asked asked, const int* valid, float* tfar, const TriangleGeometry& geometry,
                          TriangleRun run) {
  const Met met = any_sees(packet, asked, valid, geometry, run);
  if (met.first) take_closest(packet, asked, valid, tfar, geometry, run.first);
  if (met.second) take_closest(packet, asked, valid, tfar, geometry, run.second());
}

WHITTLE_WIDE void occluded(const Packet& packet, Asked asked, const int* valid, float* tfar,
                           const TriangleGeometry& geometry, TriangleRun run) {
  const Met met = any_sees(packet, asked, valid, geometry, run);
  if (met.first) take_blocked(packet, asked, valid, tfar, geometry, run.first);
  if (met.second) take_blocked(packet, asked, valid, tfar, geometry, run.second());
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
