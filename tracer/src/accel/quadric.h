#pragma once
/// Analytic shapes in their own space: each is a standard shape, and an affine map of it into the trace frame, so any
/// non-singular transform of any of them is the same code. Rays are carried over unnormalised: distances stay what they
/// are.
///
///   ellipsoid  x^2 + y^2 + z^2 = 1
///   disc       z = 0, inner <= r <= 1
///   frustum    r = radius_0 + (radius_1 - radius_0) z for 0 <= z <= 1: cylinders and cones; closed by discs where
///   `caps` box        0 <= x, y, z <= 1
///
/// Comparisons are closed, so that rims do not leak.

#include <cstdint>

#include "tracer/src/math/affine.h"

namespace tracer {

enum class QuadricKind : std::uint8_t { ellipsoid, disc, frustum, box };

/// Which part of a shape was met; also what decides its normal and texture coordinates.
enum class QuadricPart : std::uint8_t { side, cap_0, cap_1, x_0, x_1, y_0, y_1, z_0, z_1 };

struct Quadric {
  Vec3 origin;              ///< of the shape's space, in the trace frame
  Linear shape_from_trace;  ///< of offsets from `origin`
  Linear trace_from_shape;
  double radius_0 = 1;  ///< frustum: at z = 0; disc: the hole's
  double radius_1 = 1;  ///< frustum: at z = 1
  QuadricKind kind = QuadricKind::ellipsoid;
  bool caps = true;
};

/// How far, in the shape's own units, a hit may lie beyond a rim: the rounding of the point. Side and cap then overlap
/// by that much instead of leaving a gap.
inline constexpr double rim_slack = 0x1p-46;

/// The map is that of the shape's space into the trace frame. Precondition: not singular.
inline Quadric quadric(QuadricKind kind, const Affine& trace_from_shape) {
  return {.origin = trace_from_shape.offset,
          .shape_from_trace = inverse(trace_from_shape.linear),
          .trace_from_shape = trace_from_shape.linear,
          .kind = kind};
}

/// Half extents of the box around the unit sphere's, or around a flat unit disc's, image: row lengths of the map.
inline Vec3 ellipsoid_extent(const Linear& m) {
  return {std::hypot(m.x.x, m.y.x, m.z.x), std::hypot(m.x.y, m.y.y, m.z.y), std::hypot(m.x.z, m.y.z, m.z.z)};
}
inline Vec3 disc_extent(const Linear& m) {
  return {std::hypot(m.x.x, m.y.x), std::hypot(m.x.y, m.y.y), std::hypot(m.x.z, m.y.z)};
}

}  // namespace tracer
