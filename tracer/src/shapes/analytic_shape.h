#pragma once
/// Analytic shapes: each is the image of a standard shape (unit_sphere.h, unit_disc.h, frustum.h, unit_cube.h,
/// unit_torus.h; listed in shape_registry.h) under an affine map into render space, so that any non-singular transform
/// of any shape is the same code. Rays are mapped into the standard shape's space unnormalised: distances along them
/// stay the same.
///
/// A standard shape is a struct that derives from StandardShape and defines
///   box(q), include(bounds, q)     its box in its own space, and tight bounds in render space
///   with_hit(q, use)               calls use(f), f(ray) being the nearest hit at a distance > 0
///   point(q0, q1, part, p)         the surface point next to p, with its normal; branch-free unless `scalar`
///   uv(q, part, p), gradients(q, part, p)   texture coordinates and their gradients
/// and its header defines, for each document shape S that it represents, standard_image(S), reach(S) and check(...).

#include <cstdint>
#include <optional>

#include "tracer/src/math/bounds.h"
#include "tracer/src/shapes/primitive_point.h"

namespace tracer {

/// Position of a standard shape in the registry's list.
enum class QuadricKind : std::uint8_t {};

/// Part of a shape's surface that a ray intersects; selects its normal and texture coordinates.
enum class QuadricPart : std::uint8_t { side, cap_0, cap_1, x_0, x_1, y_0, y_1, z_0, z_1 };

struct Quadric {
  Vec3 origin;               ///< origin of the shape's space, in render space
  Linear shape_from_render;  ///< maps offsets from `origin`
  Linear render_from_shape;
  double radius_0 = 1;  ///< frustum: at z = 0; disc: radius of the hole; torus: radius of the tube
  double radius_1 = 1;  ///< frustum: at z = 1
  QuadricKind kind{};
  bool caps = true;  ///< frustum: closed by discs
};

/// Precondition: the map is not singular.
inline Quadric quadric(QuadricKind kind, const Affine& render_from_shape) {
  return {.origin = render_from_shape.offset,
          .shape_from_render = inverse(render_from_shape.linear),
          .render_from_shape = render_from_shape.linear,
          .kind = kind};
}

/// A document shape as the image of the standard shape `Standard`.
template <class Standard>
struct StandardImage {
  Affine object_from_standard;
  double radius_0 = 1, radius_1 = 1;
  bool caps = true;
};

/// Nearest hit at a distance > 0; `t` is infinite when there is none.
struct QuadricHit {
  double t = std::numeric_limits<double>::infinity();
  double part = 0;  ///< a QuadricPart, in the lanes' own type
};

/// A ray in the shape's space; the direction need not be unit.
struct ShapeRay {
  double ox, oy, oz, dx, dy, dz;
};

/// In the shape's own space; the normal need not be unit.
struct ShapePoint {
  Vec3 position, normal;
};

/// Gradients of texture coordinates. Their components across the surface are arbitrary.
struct UvGradients {
  Vec3 u, v;
};

/// Defaults of a standard shape.
struct StandardShape {
  static constexpr std::uint64_t max_hits = 2;  ///< maximum for a straight line
  static constexpr bool scalar = false;         ///< hits and points are computed one by one, not in loops over lanes
  static constexpr bool culls = false;          ///< may_hit(ray, q) is a cheap test that rejects most rays
  static double curvature(const Quadric&) { return 0; }  ///< largest, in render space
  static double error(const Quadric&) { return 0; }      ///< error of its points beyond rounding, in its own units
};

/// Distance by which a hit may lie beyond a rim, in the shape's own units: the rounding of the point. Side and cap then
/// overlap by that much instead of leaving a gap.
inline constexpr double rim_slack = 0x1p-46;

WHITTLE_INLINE void consider(QuadricHit& best, double t, bool valid, QuadricPart part) {
  const bool nearer = valid & (t > 0) & (t < best.t);
  best.t = nearer ? t : best.t;
  best.part = nearer ? static_cast<double>(part) : best.part;
}

WHITTLE_INLINE ShapeRay shape_ray(const Quadric& q, const Vec3& origin, const Vec3& direction) {
  const Vec3 o = q.shape_from_render * (origin - q.origin), d = q.shape_from_render * direction;
  return {o.x, o.y, o.z, d.x, d.y, d.z};
}

/// Half extents of the box around the image of a unit sphere, or of a unit disc across z: row lengths of the map.
inline Vec3 ellipsoid_extent(const Linear& m) {
  return {std::hypot(m.x.x, m.y.x, m.z.x), std::hypot(m.x.y, m.y.y, m.z.y), std::hypot(m.x.z, m.y.z, m.z.z)};
}
inline Vec3 disc_extent(const Linear& m) {
  return {std::hypot(m.x.x, m.y.x), std::hypot(m.x.y, m.y.y), std::hypot(m.x.z, m.y.z)};
}

/// Map of a round shape about `axis` (any length): e0 and e1 of length `radius`, and the axis unchanged.
inline Affine round_about(const Vec3& origin, const Vec3& axis, const std::optional<Vec3>& u_axis, double radius) {
  const Axes axes = axes_across(normalize(axis), u_axis.value_or(Vec3{1, 0, 0}));
  return {{axes.e0 * radius, axes.e1 * radius, axis}, origin};
}

/// Angle of (x, y) in turns, in [0,1). Just below the seam, where adding one would round up to the next turn, it is the
/// largest number below one.
inline double turns(double y, double x) {
  const double t = std::atan2(y, x) / (2 * std::numbers::pi);
  return t < 0 ? std::min(t + 1, 1 - 0x1p-53) : t;
}

/// Gradient of the angle about z, in turns.
inline Vec3 turn_gradient(const Vec3& p) {
  const double turn = 2 * std::numbers::pi * (p.x * p.x + p.y * p.y);
  return {-p.y / turn, p.x / turn, 0};
}

inline Vec2 disc_uv(const Vec3& p, double radius) {
  return radius > 0 ? Vec2{p.x / (2 * radius) + 0.5, p.y / (2 * radius) + 0.5} : Vec2{0.5, 0.5};
}
inline UvGradients disc_gradients(double radius) { return {{1 / (2 * radius), 0, 0}, {0, 1 / (2 * radius), 0}}; }

WHITTLE_INLINE double within_unit(double x) { return x < 0 ? 0 : (1 < x ? 1 : x); }

WHITTLE_INLINE Linear absolute(const Linear& m) { return {abs(m.x), abs(m.y), abs(m.z)}; }

/// A point of a shape in render space. `shape_error` is StandardShape::error.
WHITTLE_INLINE PrimitivePoint placed(const ShapePoint& local, double shape_error, const Vec3& origin,
                                     const Linear& shape_from_render, const Linear& render_from_shape) {
  const Vec3 arm = render_from_shape * local.position;
  const Vec3 position = origin + arm;
  // Error of mapping the point there and its next ray back: both maps with their absolute entries.
  const double bound = rounding_bound(16) + shape_error;
  const Vec3 reach = absolute(shape_from_render) * abs(arm) + Vec3{1, 1, 1};
  const Vec3 error = absolute(render_from_shape) * reach * bound + (abs(position) + abs(origin)) * rounding_bound(2);
  const Linear& m = render_from_shape;
  const Vec3 across_x = cross(m.y, m.z), across_y = cross(m.z, m.x), across_z = cross(m.x, m.y);
  const double outward = dot(m.x, across_x) < 0 ? -1.0 : 1.0;  // reflections turn the cofactors inwards
  const Vec3 normal = across_x * local.normal.x + across_y * local.normal.y + across_z * local.normal.z;
  return {position, error, {normal.x * outward, normal.y * outward, normal.z * outward}};
}

}  // namespace tracer
