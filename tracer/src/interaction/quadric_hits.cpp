#include "tracer/src/interaction/quadric_hits.h"

#include "tracer/src/shapes/quadric_point.h"

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

// One loop for each kind of shape, over all lanes: in one alone they would be branches.

WHITTLE_INLINE void meet_sides(const QuadricPacket& __restrict s, ShapePoints& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const ShapePoint at = on_side(s.radius_0[i], s.radius_1[i], {p.on_x[i], p.on_y[i], p.on_z[i]});
    p.x[i] = at.position.x;
    p.y[i] = at.position.y;
    p.z[i] = at.position.z;
    p.normal_x[i] = at.normal.x;
    p.normal_y[i] = at.normal.y;
    p.normal_z[i] = at.normal.z;
  }
}

WHITTLE_INLINE void disc_points(const QuadricPacket& __restrict s, ShapePoints& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const bool frustum = s.kind[i] == static_cast<double>(QuadricKind::frustum);
    const bool cap_0 = frustum & (s.part[i] == static_cast<double>(QuadricPart::cap_0));
    const bool cap_1 = frustum & (s.part[i] == static_cast<double>(QuadricPart::cap_1));
    const bool flat = cap_0 | cap_1 | (s.kind[i] == static_cast<double>(QuadricKind::disc));
    const double z = cap_1 ? 1 : 0, out = cap_0 ? -1 : 1;
    p.x[i] = flat ? p.on_x[i] : p.x[i];
    p.y[i] = flat ? p.on_y[i] : p.y[i];
    p.z[i] = flat ? z : p.z[i];
    p.normal_x[i] = flat ? 0 : p.normal_x[i];
    p.normal_y[i] = flat ? 0 : p.normal_y[i];
    p.normal_z[i] = flat ? out : p.normal_z[i];
  }
}

WHITTLE_INLINE void meet_boxes(const QuadricPacket& __restrict s, ShapePoints& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const bool box = s.kind[i] == static_cast<double>(QuadricKind::box);
    const Vec3 out = out_of_box(s.part[i]);
    const double x = on_box(out.x, p.on_x[i]), y = on_box(out.y, p.on_y[i]), z = on_box(out.z, p.on_z[i]);
    p.x[i] = box ? x : p.x[i];
    p.y[i] = box ? y : p.y[i];
    p.z[i] = box ? z : p.z[i];
    p.normal_x[i] = box ? out.x : p.normal_x[i];
    p.normal_y[i] = box ? out.y : p.normal_y[i];
    p.normal_z[i] = box ? out.z : p.normal_z[i];
  }
}

WHITTLE_INLINE void meet_ellipsoids(const QuadricPacket& __restrict s, ShapePoints& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const bool ball = s.kind[i] == static_cast<double>(QuadricKind::ellipsoid);
    const Vec3 at = on_ball({p.on_x[i], p.on_y[i], p.on_z[i]});
    p.normal_x[i] = ball ? at.x : p.normal_x[i];
    p.normal_y[i] = ball ? at.y : p.normal_y[i];
    p.normal_z[i] = ball ? at.z : p.normal_z[i];
    p.x[i] = ball ? at.x : p.x[i];
    p.y[i] = ball ? at.y : p.y[i];
    p.z[i] = ball ? at.z : p.z[i];
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
  to.rims[i] = rims_of(from);
}

WHITTLE_WIDE LaneMask meet(const QuadricPacket& __restrict s, const RayHitPacket& __restrict met,
                           FacePacket& __restrict to) {
  ShapePoints p;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 on_ray{met.on_x[i], met.on_y[i], met.on_z[i]}, origin{s.x[i], s.y[i], s.z[i]};
    const Vec3 on = lane_of(s.to_shape, i) * (on_ray - origin);
    p.on_x[i] = on.x;
    p.on_y[i] = on.y;
    p.on_z[i] = on.z;
  }
  meet_sides(s, p);
  disc_points(s, p);
  meet_boxes(s, p);
  meet_ellipsoids(s, p);
  for (int i = 0; i < lanes; ++i)
    put(placed({{p.x[i], p.y[i], p.z[i]}, {p.normal_x[i], p.normal_y[i], p.normal_z[i]}}, s.rims[i],
               {s.x[i], s.y[i], s.z[i]}, lane_of(s.to_shape, i), lane_of(s.from_shape, i)),
        i, to);
  return normalize(to);
}

}  // namespace tracer
