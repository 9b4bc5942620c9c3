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

#include "tracer/src/math/affine.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/math/rounding.h"

namespace tracer {

// Surface points and normals of the simplest primitives, bit-identical for single hits and packets.

/// A point on a primitive, its error bound, and the outward normal.
struct PrimitivePoint {
  Vec3 position, error;
  Vec3 across;  ///< not unit in general
};

/// The point of a sphere next to `on_ray`. Points on rays lose digits with the ray's length, so the point is projected
/// onto the sphere; the remaining error is the rounding of that and of the quadratic's constant term, which sixteen
/// operations cover.
WHITTLE_INLINE PrimitivePoint sphere_point(const Vec3& center, double radius, const Vec3& on_ray) {
  const Vec3 scaled = (on_ray - center) / radius;
  const double distance = length(scaled);  // 0 where a ray from 10^16 radii away has no digit left for the surface
  const double stretch = distance > 0 ? 1 / distance : 0;
  const Vec3 normal = scaled * stretch;
  const Vec3 arm = normal * radius;
  const Vec3 position = center + arm;
  // By components: a copy of the whole would keep the loop from being vectorized.
  return {position,
          abs(arm) * rounding_bound(16) + (abs(position) + abs(center)) * rounding_bound(2),
          {normal.x, normal.y, normal.z}};
}

/// Position and error from the barycentric coordinates (PBR 4th ed., sec. 6.8.5).
WHITTLE_INLINE PrimitivePoint triangle_point(const Vec3& a, const Vec3& b, const Vec3& c, double u, double v) {
  const Vec3 from_a = a * (1 - u - v), from_b = b * u, from_c = c * v;
  return {from_a + from_b + from_c, (abs(from_a) + abs(from_b) + abs(from_c)) * rounding_bound(7), cross(b - a, c - a)};
}

/// The point of a plane next to `on_ray`.
WHITTLE_INLINE PrimitivePoint plane_point(const Vec3& point, const Vec3& normal, const Vec3& on_ray) {
  const Vec3 position = on_ray - normal * dot(on_ray - point, normal);
  return {position, (abs(position) + abs(point)) * rounding_bound(8), {normal.x, normal.y, normal.z}};
}

/// A vertex of a triangle, and its weight at the hit.
struct SmoothVertex {
  Vec3 position, normal;
  double weight;
};

/// One vertex's part of the offset from a point of a triangle to the curved surface that the vertex normals suggest:
/// the mean of its projections onto the vertices' tangent planes, if these are outside. Shadow rays start there;
/// otherwise the facets of a coarse mesh would shadow each other although their normals face the light (Hanika 2021,
/// "Hacking the Shadow Terminator", Ray Tracing Gems II, ch. 4).
WHITTLE_INLINE Vec3 toward_tangent_plane(const SmoothVertex& vertex, const Vec3& position, const Vec3& face) {
  const double side = dot(vertex.normal, face) < 0 ? -1.0 : 1.0;
  const Vec3 normal = vertex.normal * side;
  const double height = dot(position - vertex.position, normal);
  return normal * (-(height < 0 ? height : 0.0) * vertex.weight);
}

/// Shading normal and shadow offset of a triangle with the geometric normal `face`.
struct SmoothPoint {
  Vec3 normal;         ///< unit, on the side of `face`
  Vec3 shadow_offset;  ///< to the curved surface
};

/// A vertex without a normal of its own has the zero vector. If the normals cancel, the normal of the face is used.
WHITTLE_INLINE SmoothPoint smooth_point(const SmoothVertex& a, const SmoothVertex& b, const SmoothVertex& c,
                                        const Vec3& position, const Vec3& face) {
  const Vec3 sum = a.normal * a.weight + b.normal * b.weight + c.normal * c.weight;
  const double squared = dot(sum, sum);
  const double curved = squared > 0x1p-40 ? 1.0 : 0.0;
  const double side = dot(sum, face) < 0 ? -1.0 : 1.0;
  const double size = std::sqrt(squared);
  const Vec3 offset = toward_tangent_plane(a, position, face) + toward_tangent_plane(b, position, face) +
                      toward_tangent_plane(c, position, face);
  return {select(curved > 0, sum / size * side, face), {offset.x * curved, offset.y * curved, offset.z * curved}};
}

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
  bool operator==(const Quadric&) const = default;
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

WHITTLE_INLINE void update_nearest(QuadricHit& best, double t, bool valid, QuadricPart part) {
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
