#include <type_traits>

#include "tracer/src/accel/packet.h"
#include "tracer/src/accel/triangle_pairs.h"

namespace tracer {
namespace {

/// Calls `with(shear_of)` with code for the packet's dominant axis: if all rays share it, it is selected once and not
/// in each lane.
template <class With>
WHITTLE_INLINE auto with_dominant_axis(const Packet& p, const With& with) {
  const auto along = [&](auto along_x, auto along_y) __attribute__((always_inline)) {
    return with([&](int i) __attribute__((always_inline)) {
      return ray_shear(p.origin[i], p.direction[i], along_x.value, along_y.value);
    });
  };
  switch (p.dominant) {
    case DominantAxis::x:
      return along(std::true_type{}, std::false_type{});
    case DominantAxis::y:
      return along(std::false_type{}, std::true_type{});
    case DominantAxis::z:
      return along(std::false_type{}, std::false_type{});
    case DominantAxis::mixed:
      break;
  }
  return with([&](int i) __attribute__((always_inline)) { return ray_shear(p.origin[i], p.direction[i]); });
}

/// Bits of the triangles that any valid lane may hit and does not start on.
template <bool pair, int count>
WHITTLE_INLINE int any_may_hit(const Packet& p, int first_lane, const int* valid, RTCRayN* rays,
                               const TrianglePairBounds& bounds) {
  const float *ox = &RTCRayN_org_x(rays, count, 0), *dx = &RTCRayN_dir_x(rays, count, 0);
  const float *oy = &RTCRayN_org_y(rays, count, 0), *dy = &RTCRayN_dir_y(rays, count, 0);
  const float *oz = &RTCRayN_org_z(rays, count, 0), *dz = &RTCRayN_dir_z(rays, count, 0);
  const float* error_bound = p.error_bound + first_lane;
  const std::uint32_t* from_geometry = p.from_geometry + first_lane;
  const std::uint32_t* from_primitive = p.from_primitive + first_lane;
  const TrianglePairBounds corners = bounds;
  const float float_bound = bounds.longest * p.float_bound;
  int any = 0;
  for (int k = 0; k < count; ++k) {
    const int may = may_hit<pair>(corners, {ox[k], oy[k], oz[k]}, {dx[k], dy[k], dz[k]}, float_bound + error_bound[k]);
    const bool on_first = (from_geometry[k] == corners.geometry) & (from_primitive[k] == corners.triangles.first);
    const bool on_second = (from_geometry[k] == corners.geometry) & (from_primitive[k] == corners.triangles.second);
    any |= may & (on_first ? ~first_triangle : ~0) & (on_second ? ~second_triangle : ~0) & valid[k];
  }
  return any;
}

template <bool pair>
WHITTLE_INLINE int any_may_hit(const Packet& p, LaneRange range, const int* valid, RTCRayN* rays,
                               const TrianglePairBounds& bounds) {
  if (range.count == packet_size) return any_may_hit<pair, packet_size>(p, 0, valid, rays, bounds);
  if (range.count == half_packet) return any_may_hit<pair, half_packet>(p, range.first, valid, rays, bounds);
  return pair ? first_triangle | second_triangle : first_triangle;
}

/// Calls `intersect` for each triangle of the pair that any valid lane may hit.
template <class Intersect>
WHITTLE_INLINE void for_triangles(const Packet& p, LaneRange range, const int* valid, RTCRayN* rays,
                                  const TrianglePairBounds& bounds, const Intersect& intersect) {
  const int any = bounds.pair() ? any_may_hit<true>(p, range, valid, rays, bounds)
                                : any_may_hit<false>(p, range, valid, rays, bounds);
  if (any == 0) [[likely]]
    return;
  if ((any & first_triangle) != 0) intersect({bounds.geometry, bounds.triangles.first});
  if ((any & second_triangle) != 0) intersect({bounds.geometry, bounds.triangles.second});
}

/// Calls `use(lane, k, hit)` for the lanes of the range; `hit` is none in lanes that are not valid or start on `self`.
template <class Use>
WHITTLE_INLINE void for_each_hit(const Packet& p, LaneRange range, const int* valid, const TriangleGeometry& geometry,
                                 PrimitiveRef self, const Use& use) {
  const TriangleTest triangle = triangle_test(geometry, self.primitive);
  with_dominant_axis(
      p, [&](const auto& shear_of) __attribute__((always_inline)) {
        for_lanes(
            range, [&](int i, int k) __attribute__((always_inline)) {
              const RayShear ray = shear_of(i);
              ShearedTriangle s = sheared(ray, triangle);
              s.inside = s.inside & (valid[k] != 0) & !starts_on(p, i, self);
              use(i, k, watertight_hit(s, ray.dz));
            });
      });
}

// Functions of their own: if the compiler has two triangles at once it does not vectorize these loops.

WHITTLE_WIDE void intersect_triangle(Packet& packet, LaneRange range, const int* valid, float* __restrict tfar,
                                     const TriangleGeometry& geometry, PrimitiveRef self) {
  for_each_hit(
      packet, range, valid, geometry, self, [&](int i, int k, const TriangleHit& hit) __attribute__((always_inline)) {
        const bool nearer = update_nearest(packet, i, tfar[k], hit.t, self, true);
        packet.u[i] = nearer ? hit.u : packet.u[i];
        packet.v[i] = nearer ? hit.v : packet.v[i];
      });
}

WHITTLE_WIDE void occluded_by_triangle(const Packet& packet, LaneRange range, const int* valid, float* __restrict tfar,
                                       const TriangleGeometry& geometry, PrimitiveRef self) {
  for_each_hit(
      packet, range, valid, geometry, self, [&](int i, int k, const TriangleHit& hit) __attribute__((always_inline)) {
        update_occluded(tfar[k], hit.t < packet.t[i]);
      });
}

}  // namespace

WHITTLE_WIDE void intersect(Packet& packet, LaneRange range, const int* valid, float* tfar, RTCRayN* rays,
                            const TriangleGeometry& geometry, const TrianglePairBounds& pair) {
  for_triangles(
      packet, range, valid, rays, pair, [&](PrimitiveRef triangle) __attribute__((always_inline)) {
        intersect_triangle(packet, range, valid, tfar, geometry, triangle);
      });
}

WHITTLE_WIDE void occluded(const Packet& packet, LaneRange range, const int* valid, float* tfar, RTCRayN* rays,
                           const TriangleGeometry& geometry, const TrianglePairBounds& pair) {
  for_triangles(
      packet, range, valid, rays, pair, [&](PrimitiveRef triangle) __attribute__((always_inline)) {
        occluded_by_triangle(packet, range, valid, tfar, geometry, triangle);
      });
}

}  // namespace tracer
