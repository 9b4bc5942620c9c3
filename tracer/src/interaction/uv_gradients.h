#pragma once
/// Gradients of texture coordinates over a surface, and their use: texture footprints and perturbed normals.

#include "tracer/src/interaction/hit_packet.h"
#include "tracer/src/interaction/surface.h"

namespace tracer {

/// Render space, per unit of length there. Precondition: the scene needs textures.
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
