#pragma once
/// Surface data of hits, of single ones and of packets of 16: point, normals, texture coordinates and their gradients.

#include <array>
#include <optional>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/math/lanes.h"
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

/// Centroid of a triangle or of its polygon, with the normal of the face and the weight 1; none for other shapes.
std::optional<Corner> centroid_at(const CompiledScene& scene, const Hit& hit);

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

// Surface points of 16 hits at a time, for every kind of shape.

/// Intersections of 16 rays. All lanes hold a hit.
struct alignas(64) RayHitPacket {
  VecLanes on_ray;  ///< point on the ray at the distance of the hit
  double u[lanes], v[lanes];
  PrimitiveRef primitive[lanes];
};

/// Points with error bounds and unit geometric normals, outward.
struct alignas(64) FacePacket {
  VecLanes position, error, face;
};

/// Points on the surfaces, their objects and shading normals.
struct alignas(64) PointPacket : FacePacket {
  std::uint32_t object[lanes];

  bool smooth;      ///< some shading normals differ from the faces; else the members below are undefined
  VecLanes normal;  ///< unit shading normal, outward
  VecLanes offset;  ///< from the point to the origin of shadow rays, for front-face hits
};

/// Bit-identical to shape_hit().
void compute_points(const GeometrySet& geometry, const RayHitPacket& hits, PointPacket& points);

/// Gradients of the texture coordinates, in render space and per unit of length there. Precondition: the scene needs
/// textures.
UvGradients uv_gradients_at(const CompiledScene& scene, const Hit& hit, const Surface& surface);

/// Footprint in the texture of a square beam of side `width` along unit `direction` on a surface with unit `normal`:
/// the sides of the rectangle with the variance of the footprint's parallelogram in u and in v.
Vec2 uv_footprint(const UvGradients& gradients, const Vec3& normal, const Vec3& direction, double width);

/// 16 beams with the gradients at their hits, and their footprints.
struct alignas(64) FootprintPacket {
  VecLanes direction, gradient_u, gradient_v;
  double width[lanes];

  double u[lanes], v[lanes];
};

/// Sets `u` and `v`; bit-identical to uv_footprint().
void compute_footprints(const FacePacket& faces, FootprintPacket& packet);

// Normals perturbed by bump and normal maps. A result that is not finite or zero keeps the normal: gradients vanish
// where texture coordinates are constant, and are unbounded at poles.

/// Unit `normal` of a surface displaced by a height with this `slope` per unit of u and v, all in one unit of length:
/// N' ~ N - grad h, the gradient along the surface (Blinn 1978, "Simulation of Wrinkled Surfaces"; without
/// tangents Mikkelsen 2010, "Bump Mapping Unparametrized Surfaces on the GPU", eq. 4).
inline Vec3 bumped_normal(const Vec3& normal, const UvGradients& gradients, const Vec2& slope) {
  const Vec3 steepest = gradients.u * slope.x + gradients.v * slope.y;
  const Vec3 perturbed = normalize(normal - (steepest - normal * dot(steepest, normal)));
  return finite(perturbed) && dot(perturbed, perturbed) > 0 ? perturbed : normal;
}

/// Unit `normal` turned into the direction that `tangent_space` has in the frame of unit dp/du, dp/dv and the normal.
/// The tangents are the reciprocal basis of the gradients on the surface: dp/du = (grad v x N) / (N . grad u x grad v).
inline Vec3 mapped_normal(const Vec3& normal, const UvGradients& gradients, const Vec3& tangent_space) {
  const Vec3 u = normalize(gradients.u), v = normalize(gradients.v);
  const double side = dot(normal, cross(u, v)) < 0 ? -1 : 1;  // mirrored coordinates
  const Vec3 along_u = normalize(cross(v, normal)) * side, along_v = normalize(cross(normal, u)) * side;
  const Vec3 perturbed = normalize(along_u * tangent_space.x + along_v * tangent_space.y + normal * tangent_space.z);
  return finite(perturbed) && dot(perturbed, perturbed) > 0 ? perturbed : normal;
}

}  // namespace tracer
