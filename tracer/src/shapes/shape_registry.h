#pragma once
/// The list of analytic shapes. Accelerator, surface points, bounds, validation and reader iterate over it: a new shape
/// is its document fields (tracer/shapes.h), a header that implements analytic_shape.h, and an entry here.

#include <type_traits>

#include "tracer/src/math/affine.h"
#include "tracer/src/shapes/frustum.h"
#include "tracer/src/shapes/unit_cube.h"
#include "tracer/src/shapes/unit_disc.h"
#include "tracer/src/shapes/unit_sphere.h"
#include "tracer/src/shapes/unit_torus.h"

namespace tracer {

template <class... Standard>
struct ShapeList {};
using StandardShapes = ShapeList<UnitSphere, UnitDisc, Frustum, UnitCube, UnitTorus>;

template <class Standard, class Shapes = StandardShapes>
inline constexpr QuadricKind kind_of{};
template <class Standard, class First, class... Others>
inline constexpr QuadricKind kind_of<Standard, ShapeList<First, Others...>>{static_cast<std::uint8_t>(
    std::is_same_v<Standard, First> ? 0 : 1 + static_cast<std::uint8_t>(kind_of<Standard, ShapeList<Others...>>))};

template <class Visit, class... Standard>
WHITTLE_INLINE void for_each_kind(const Visit& visit, ShapeList<Standard...> /*list*/) {
  (void)(visit(Standard{}) || ...);
}
/// Calls visit(Standard{}) for each standard shape until it returns true.
template <class Visit>
WHITTLE_INLINE void for_each_kind(const Visit& visit) {
  for_each_kind(visit, StandardShapes{});
}

/// Calls visit(Standard{}) for the standard shape of `kind`.
template <class Visit>
WHITTLE_INLINE void visit_kind(QuadricKind kind, const Visit& visit) {
  for_each_kind([&](auto standard) __attribute__((always_inline)) {
    if (kind != kind_of<decltype(standard)>) return false;
    visit(standard);
    return true;
  });
}

/// Document shapes that have a standard image.
template <class S>
concept Analytic = requires(const S& shape) {
  standard_image(shape);
};

/// `map` takes the standard shape's space to render space.
template <class Standard>
Quadric quadric(const StandardImage<Standard>& image, const Affine& map) {
  Quadric q = quadric(kind_of<Standard>, map);
  q.radius_0 = image.radius_0;
  q.radius_1 = image.radius_1;
  q.caps = image.caps;
  return q;
}

inline Bounds local_box(const Quadric& q) {
  Bounds box;
  visit_kind(q.kind, [&](auto standard) { box = standard.box(q); });
  return box;
}

struct QuadricPoint {
  BoundedPoint point;  ///< render space
  Vec3 normal;         ///< unit, outward; a disc's is its own
};

/// `on_ray` is the hit point with the rounding of the ray's arithmetic, `part` comes from the intersection.
inline QuadricPoint quadric_point(const Quadric& q, QuadricPart part, const Vec3& on_ray) {
  PrimitivePoint at;
  visit_kind(q.kind, [&](auto standard) {
    const ShapePoint local =
        standard.point(q.radius_0, q.radius_1, static_cast<double>(part), q.shape_from_render * (on_ray - q.origin));
    at = placed(local, standard.error(q), q.origin, q.shape_from_render, q.render_from_shape);
  });
  return {{at.position, at.error}, normalize(at.across)};
}

/// Texture coordinates of a point on the shape, as tracer/shapes.h defines them.
inline Vec2 quadric_uv(const Quadric& q, QuadricPart part, const Vec3& position) {
  Vec2 uv;
  visit_kind(q.kind, [&](auto standard) { uv = standard.uv(q, part, q.shape_from_render * (position - q.origin)); });
  return uv;
}

/// Their gradients in render space.
inline UvGradients quadric_gradients(const Quadric& q, QuadricPart part, const Vec3& position) {
  UvGradients local;
  visit_kind(q.kind,
             [&](auto standard) { local = standard.gradients(q, part, q.shape_from_render * (position - q.origin)); });
  const Linear render_from_local = transposed(q.shape_from_render);
  return {render_from_local * local.u, render_from_local * local.v};
}

inline double curvature(const Quadric& q) {
  double result = 0;
  visit_kind(q.kind, [&](auto standard) { result = standard.curvature(q); });
  return result;
}

// Planes, triangles and meshes have no standard image: their extents, and validation beyond the ranges of their fields.

inline double reach(const Plane& p) { return largest_component(p.point); }
inline double reach(const Triangle& t) {
  return std::max(
      {largest_component(t.vertices[0]), largest_component(t.vertices[1]), largest_component(t.vertices[2])});
}
inline double reach(const Mesh& mesh) {
  double reach = 0;
  for (const Vec3& position : mesh.positions) reach = std::max(reach, largest_component(position));
  return reach;
}
inline double reach(const Instance&) { return 0; }

template <class Checks>
void check(Checks& checks, const Plane& plane) {
  checks.not_parallel("u_axis", plane.u_axis, plane.normal, "must not be parallel to the normal");
}

template <class Checks>
void check(Checks& checks, const Triangle& triangle) {
  const auto& [a, b, c] = triangle.vertices;
  checks.has_area("vertices", a, b - a, c - a, "the three vertices are on one line: the triangle has no area");
}

}  // namespace tracer
