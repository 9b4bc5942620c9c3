#pragma once
/// Where a ray meets an analytic shape: formulas without branches, so that loops over lanes can take them in.

#include "tracer/src/accel/quadric.h"
#include "tracer/src/math/rounding.h"
#include "tracer/src/math/wide.h"
#include "tracer/src/shapes/primitive_point.h"

namespace tracer {

/// In the shape's own space; the normal need not be unit.
struct ShapePoint {
  Vec3 position, normal;
};

WHITTLE_INLINE double within_unit(double x) { return x < 0 ? 0 : (1 < x ? 1 : x); }

/// The point of the side of a frustum next to p. The apex has no normal of its own: it looks along the axis.
WHITTLE_INLINE ShapePoint on_side(double radius_0, double radius_1, const Vec3& p) {
  const double z = within_unit(p.z), slope = radius_1 - radius_0, radius = radius_0 + slope * z;
  const double r = std::sqrt(p.x * p.x + p.y * p.y);  // no rim is so narrow that a square would vanish
  const bool apex = !((r > 0) & (radius > 0));
  const double x = p.x / r, y = p.y / r, up = slope < 0 ? 1.0 : -1.0;
  return {{apex ? 0 : x * radius, apex ? 0 : y * radius, z}, {apex ? 0 : x, apex ? 0 : y, apex ? up : -slope}};
}

/// The point of a unit ball next to p, which is its normal too.
WHITTLE_INLINE Vec3 on_ball(const Vec3& p) {
  const double size = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
  const double stretch = size > 0 ? size : 1;
  return {p.x / stretch, p.y / stretch, p.z / stretch};
}

/// One coordinate of the point of a box next to p, whose normal has `out` there: 1 or -1 on a face across it, else 0.
WHITTLE_INLINE double on_box(double out, double p) {
  const double inside = within_unit(p), side = out < 0 ? 0 : 1;
  return out == 0 ? inside : side;
}

/// What of a box's normal a part makes, by its two faces across an axis.
WHITTLE_INLINE double out_of_box(double part, QuadricPart at_0, QuadricPart at_1) {
  return (part == static_cast<double>(at_1) ? 1.0 : 0.0) - (part == static_cast<double>(at_0) ? 1.0 : 0.0);
}
WHITTLE_INLINE Vec3 out_of_box(double part) {
  return {out_of_box(part, QuadricPart::x_0, QuadricPart::x_1), out_of_box(part, QuadricPart::y_0, QuadricPart::y_1),
          out_of_box(part, QuadricPart::z_0, QuadricPart::z_1)};
}

WHITTLE_INLINE Linear absolute(const Linear& m) { return {abs(m.x), abs(m.y), abs(m.z)}; }

/// Side and caps reach beyond their rim by rim_slack: a ray that leaves one must start clear of the other.
inline double rims_of(const Quadric& q) { return q.kind == QuadricKind::frustum && q.caps ? 2 * rim_slack : 0; }

/// A point of a shape in the trace frame.
WHITTLE_INLINE PrimitivePoint placed(const ShapePoint& local, double rims, const Vec3& origin,
                                     const Linear& shape_from_trace, const Linear& trace_from_shape) {
  const Vec3 arm = trace_from_shape * local.position;
  const Vec3 position = origin + arm;
  // What mapping the point there and its next ray back can be wrong by: both maps with their absolute entries.
  const double bound = rounding_bound(16) + rims;
  const Vec3 reach = absolute(shape_from_trace) * abs(arm) + Vec3{1, 1, 1};
  const Vec3 error = absolute(trace_from_shape) * reach * bound + (abs(position) + abs(origin)) * rounding_bound(2);
  const Linear& m = trace_from_shape;
  const Vec3 across_x = cross(m.y, m.z), across_y = cross(m.z, m.x), across_z = cross(m.x, m.y);
  const double outward = dot(m.x, across_x) < 0 ? -1.0 : 1.0;  // reflections turn the cofactors inwards
  const Vec3 normal = across_x * local.normal.x + across_y * local.normal.y + across_z * local.normal.z;
  return {position, error, {normal.x * outward, normal.y * outward, normal.z * outward}};
}

}  // namespace tracer
