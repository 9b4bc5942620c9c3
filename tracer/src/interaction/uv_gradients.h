#pragma once
/// Gradients of texture coordinates over a surface, for filtering and perturbed normals.

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
  double direction_x[lanes], direction_y[lanes], direction_z[lanes];
  double width[lanes];
  double gradient_u[3][lanes], gradient_v[3][lanes];

  double u[lanes], v[lanes];

  void put(int i, const UvGradients& gradients, const Vec3& direction, double width_there);
};

/// Sets `u` and `v`; bit-identical to uv_footprint().
void compute_footprints(const FacePacket& faces, FootprintPacket& packet);

}  // namespace tracer
