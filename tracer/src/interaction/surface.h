#pragma once
/// From "this ray meets that primitive at t" to everything shading needs to know of the point.

#include <array>
#include <optional>

#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/math/rounding.h"

namespace tracer {

struct Surface {
  BoundedPoint point;     ///< trace frame, refined onto the primitive
  Vec3 geometric_normal;  ///< unit, outward (front) side
  Vec3 normal;            ///< unit shading normal on the ray's side
  Vec3 shadow_offset;     ///< from the point to where the surface that the normals suggest would be (zero if flat)
  bool back = false;      ///< the ray meets the back side
  std::uint32_t material = 0;
  std::uint32_t object = 0;
  Vec2 uv;  ///< 0,0 unless the material is textured
};

/// A hit as the accelerator tells it.
struct Hit {
  PrimitiveRef primitive;
  double t = 0, u = 0, v = 0;
};

/// A corner of the triangle that was met.
struct Corner {
  BoundedPoint point;
  Vec3 normal;        ///< the vertex's, or the face's; unit, outward
  double weight = 0;  ///< its barycentric coordinate at the hit
};
using Corners = std::array<Corner, 3>;

/// Of a triangle; nothing when another shape was met.
std::optional<Corners> corners_at(const CompiledScene& scene, const Hit& hit);

/// Precondition: `hit.primitive.hit()`, and `direction` is unit.
Surface surface_at(const CompiledScene& scene, const Hit& hit, const Vec3& origin, const Vec3& direction,
                   Approximations::Shading shading = Approximations::Shading::exact);

/// What one shape knows of a hit.
struct ShapeHit {
  BoundedPoint point;
  Vec3 geometric_normal;  ///< unit, outward
  Vec3 shading_normal;    ///< unit, on the same side
  Vec3 shadow_offset{};   ///< as the surface's, seen from outside
  std::uint32_t object = 0;
};

/// `on_ray` is where the ray's arithmetic has the hit.
ShapeHit shape_hit(const GeometrySet& set, const Hit& hit, const Vec3& on_ray);

bool is_textured(const Material& material);

/// Texture coordinates of a hit of which all else is known. Precondition: the scene needs textures.
Vec2 uv_at(const CompiledScene& scene, const Hit& hit, const Surface& surface);

}  // namespace tracer
