#include "tracer/src/accel/packet.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// The lanes' rays in the shape's space.
struct alignas(64) ShapeRays {
  VecLanes origin, direction;
  [[nodiscard]] WHITTLE_INLINE ShapeRay operator[](int i) const {
    return {origin.x[i], origin.y[i], origin.z[i], direction.x[i], direction.y[i], direction.z[i]};
  }
};

/// QuadricHit of each lane.
struct alignas(64) QuadricHits {
  double t[packet_size], part[packet_size];
};

/// Returns true if any valid lane may hit the shape: only these pay for exact sums and quotients.
template <class Standard>
WHITTLE_INLINE bool any_may_hit_quadric(const ShapeRays& rays, LaneRange range, const int* valid,
                                        const Quadric& quadric) {
  const double radius_0 = quadric.radius_0, radius_1 = quadric.radius_1;
  int may = 0;
  for_lanes(
      range, [&](int i, int k) __attribute__((always_inline)) {
        may |= Standard::may_hit(rays[i], radius_0, radius_1) ? valid[k] : 0;
      });
  return may != 0;
}

template <bool scalar, class HitOf>
WHITTLE_INLINE void intersect_lanes(const ShapeRays& rays, LaneRange range, const int* valid, QuadricHits& hits,
                                    const HitOf& hit_of) {
  for_lanes(
      range, [&](int i, int k) __attribute__((always_inline)) {
        const QuadricHit hit = scalar && valid[k] == 0 ? QuadricHit{} : hit_of(rays[i]);
        hits.t[i] = hit.t;
        hits.part[i] = hit.part;
      });
}

/// Computes the hits of the range; returns false if no valid lane hits the shape. The kind is selected once, outside
/// the loop.
WHITTLE_INLINE bool any_quadric_hit(const Packet& p, LaneRange range, const int* valid, const Quadric& quadric,
                                    QuadricHits& hits) {
  ShapeRays rays;
  for_lanes(
      range, [&](int i, int /*k*/) __attribute__((always_inline)) {
        const ShapeRay ray = shape_ray(quadric, p.origin[i], p.direction[i]);
        rays.origin.set(i, {ray.ox, ray.oy, ray.oz});
        rays.direction.set(i, {ray.dx, ray.dy, ray.dz});
      });
  bool any = false;
  visit_kind(
      quadric.kind, [&](auto standard) __attribute__((always_inline)) {
        using Standard = decltype(standard);
        if constexpr (Standard::culls) {
          if (!any_may_hit_quadric<Standard>(rays, range, valid, quadric)) return;
        }
        any = true;
        Standard::with_hit(
            quadric, [&](const auto& hit_of) __attribute__((always_inline)) {
              intersect_lanes<Standard::scalar>(rays, range, valid, hits, hit_of);
            });
      });
  return any;
}

/// Reduces the range to its valid lane if there is only one. Embree traces rays one by one where few of a packet stay
/// together: two thirds of the calls in a lattice of mirrors.
WHITTLE_INLINE void reduce_to_single(LaneRange& range, const int*& valid, float*& tfar) {
  int negative_count = 0, last = 0;
  for_lanes(
      range, [&](int /*i*/, int k) __attribute__((always_inline)) {
        negative_count += valid[k];
        last |= valid[k] & k;
      });
  if (negative_count != -1) return;
  range = {range.first + last, 1};
  valid += last;
  tfar += last;
}

}  // namespace

// WHITTLE_WIDE also because of their exact products, which are library calls where the instruction set has no FMA.

WHITTLE_WIDE void intersect(Packet& packet, LaneRange range, const int* valid, float* tfar, RTCRayN* /*rays*/,
                            const QuadricGeometry& geometry, PrimitiveRef self) {
  reduce_to_single(range, valid, tfar);
  QuadricHits hits;
  if (!any_quadric_hit(packet, range, valid, geometry.quadrics[self.primitive], hits)) return;
  for_lanes(
      range, [&](int i, int k) __attribute__((always_inline)) {
        const double t = hits.t[i];
        const bool hit = (valid[k] != 0) & (t < std::numeric_limits<double>::infinity());
        const bool nearer = update_nearest(packet, i, tfar[k], t, self, hit);
        packet.u[i] = nearer ? hits.part[i] : packet.u[i];
      });
}

WHITTLE_WIDE void occluded(const Packet& packet, LaneRange range, const int* valid, float* __restrict tfar,
                           RTCRayN* /*rays*/, const QuadricGeometry& geometry, PrimitiveRef self) {
  QuadricHits hits;
  if (!any_quadric_hit(packet, range, valid, geometry.quadrics[self.primitive], hits)) return;
  for_lanes(
      range, [&](int i, int k) __attribute__((always_inline)) {
        update_occluded(tfar[k], (valid[k] != 0) & (hits.t[i] < packet.t[i]));
      });
}

}  // namespace tracer
