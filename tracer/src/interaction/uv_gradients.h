#pragma once
/// How fast texture coordinates change over a surface: what filtering and bending normals need.

#include "tracer/src/interaction/hit_packet.h"
#include "tracer/src/interaction/surface.h"

namespace tracer {

/// Render space, per unit of length there. Precondition: the scene needs textures.
UvGradients uv_gradients_at(const CompiledScene& scene, const Hit& hit, const Surface& surface);

/// The part of the texture that a square beam of side `width` along unit `direction` covers of a surface with unit
/// `normal`: sides of the rectangle that has the variance of the covered parallelogram in u and in v.
Vec2 covered_uv(const UvGradients& gradients, const Vec3& normal, const Vec3& direction, double width);

/// Sixteen beams and the gradients where they meet surfaces, and what they cover.
struct alignas(64) CoveredPacket {
  double direction_x[lanes], direction_y[lanes], direction_z[lanes];
  double width[lanes];
  double gradient_u[3][lanes], gradient_v[3][lanes];

  double u[lanes], v[lanes];

  void put(int i, const UvGradients& gradients, const Vec3& direction, double width_there);
};

/// Fills `u` and `v`: the same bits one by one.
void find_covered(const FacePacket& faces, CoveredPacket& packet);

}  // namespace tracer
