#pragma once
/// Surface data of a single hit: point, normals, texture coordinates.

#include <array>
#include <optional>

#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/math/rounding.h"

namespace tracer {

struct Surface {
  BoundedPoint point;     ///< render space, refined onto the primitive
  Vec3 geometric_normal;  ///< unit, outward (front) side
  Vec3 normal;            ///< unit shading normal on the incident side
  Vec3 shadow_offset;     ///< from the point to the smooth surface that the normals suggest; zero if flat
  bool back = false;      ///< back-face hit
  std::uint32_t material = 0;
  std::uint32_t object = 0;
  Vec2 uv;  ///< 0,0 unless the material is textured
};

/// Intersection found by the accelerator.
struct Hit {
  PrimitiveRef primitive;
  double t = 0, u = 0, v = 0;
};

/// Vertex of the triangle that was hit.
struct Corner {
  BoundedPoint point;
  Vec3 normal;        ///< normal of the vertex or else of the face; unit, outward
  double weight = 0;  ///< barycentric coordinate of the hit
};
using Corners = std::array<Corner, 3>;

/// Vertices of a triangle; none for other shapes.
std::optional<Corners> corners_at(const CompiledScene& scene, const Hit& hit);

/// Precondition: `hit.primitive.hit()`, and `direction` is unit.
Surface surface_at(const CompiledScene& scene, const Hit& hit, const Vec3& origin, const Vec3& direction,
                   Approximations::Shading shading = Approximations::Shading::exact);

/// Hit of one shape, without materials.
struct ShapeHit {
  BoundedPoint point;
  Vec3 geometric_normal;  ///< unit, outward
  Vec3 shading_normal;    ///< unit, on the same side
  Vec3 shadow_offset{};   ///< as that of Surface, for front-face hits
  std::uint32_t object = 0;
};

/// `on_ray`: point on the ray at the distance of the hit.
ShapeHit shape_hit(const GeometrySet& set, const Hit& hit, const Vec3& on_ray);

bool is_textured(const Material& material);

/// Curvature of the surface, 1 / radius, positive if convex: exact on spheres, that of the smallest axis on other round
/// shapes, 0 on flat ones and on meshes, whose reflections are filtered less than possible.
double curvature_at(const CompiledScene& scene, const PrimitiveRef& primitive);

/// Texture coordinates of a hit; the rest of `surface` must be set. Precondition: the scene needs textures.
Vec2 uv_at(const CompiledScene& scene, const Hit& hit, const Surface& surface);

}  // namespace tracer
