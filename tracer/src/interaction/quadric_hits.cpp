#include "tracer/src/interaction/quadric_hits.h"

#include "tracer/src/shapes/registry.h"

namespace tracer {
namespace {

/// In the quadrics' own spaces: where the rays' arithmetic has the hits, and what is there.
struct alignas(64) ShapePoints {
  double on_x[lanes], on_y[lanes], on_z[lanes];
  double x[lanes], y[lanes], z[lanes];
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];
};

WHITTLE_INLINE Linear lane_of(const double (&map)[9][lanes], int i) {
  return {{map[0][i], map[1][i], map[2][i]}, {map[3][i], map[4][i], map[5][i]}, {map[6][i], map[7][i], map[8][i]}};
}

/// One loop for each kind of shape in the packet, over all lanes: within one loop the kinds would be branches.
template <class Standard>
WHITTLE_INLINE void compute_points(const QuadricPacket& __restrict s, ShapePoints& __restrict p) {
  constexpr auto kind = static_cast<double>(kind_of<Standard>);
  for (int i = 0; i < lanes; ++i) {
    const bool taken = s.kind[i] == kind;
    const ShapePoint at = Standard::point(s.radius_0[i], s.radius_1[i], s.part[i], {p.on_x[i], p.on_y[i], p.on_z[i]});
    p.x[i] = taken ? at.position.x : p.x[i];
    p.y[i] = taken ? at.position.y : p.y[i];
    p.z[i] = taken ? at.position.z : p.z[i];
    p.normal_x[i] = taken ? at.normal.x : p.normal_x[i];
    p.normal_y[i] = taken ? at.normal.y : p.normal_y[i];
    p.normal_z[i] = taken ? at.normal.z : p.normal_z[i];
  }
}

void gather(const Linear& map, int i, double (&to)[9][lanes]) {
  int entry = 0;
  for (const Vec3& column : {map.x, map.y, map.z})
    for (const double value : {column.x, column.y, column.z}) to[entry++][i] = value;
}

}  // namespace

void gather(const Quadric& from, double part, int i, QuadricPacket& to) {
  to.x[i] = from.origin.x;
  to.y[i] = from.origin.y;
  to.z[i] = from.origin.z;
  gather(from.shape_from_trace, i, to.to_shape);
  gather(from.trace_from_shape, i, to.from_shape);
  to.kind[i] = static_cast<double>(from.kind);
  to.part[i] = part;
  to.radius_0[i] = from.radius_0;
  to.radius_1[i] = from.radius_1;
  visit_kind(from.kind, [&](auto standard) { to.error[i] = standard.error(from); });
  to.kinds |= 1u << static_cast<unsigned>(from.kind);
}

WHITTLE_WIDE LaneMask compute_points(const QuadricPacket& __restrict s, const RayHitPacket& __restrict hits,
                                     FacePacket& __restrict to) {
  ShapePoints p{};
  for (int i = 0; i < lanes; ++i) {
    const Vec3 on_ray{hits.on_x[i], hits.on_y[i], hits.on_z[i]}, origin{s.x[i], s.y[i], s.z[i]};
    const Vec3 on = lane_of(s.to_shape, i) * (on_ray - origin);
    p.on_x[i] = on.x;
    p.on_y[i] = on.y;
    p.on_z[i] = on.z;
  }
  for_each_kind([&](auto standard) __attribute__((always_inline)) {
    using Standard = decltype(standard);
    if ((s.kinds >> static_cast<unsigned>(kind_of<Standard>) & 1) != 0) compute_points<Standard>(s, p);
    return false;
  });
  for (int i = 0; i < lanes; ++i)
    put(placed({{p.x[i], p.y[i], p.z[i]}, {p.normal_x[i], p.normal_y[i], p.normal_z[i]}}, s.error[i],
               {s.x[i], s.y[i], s.z[i]}, lane_of(s.to_shape, i), lane_of(s.from_shape, i)),
        i, to);
  return normalize(to);
}

}  // namespace tracer
