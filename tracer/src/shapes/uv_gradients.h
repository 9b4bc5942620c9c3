#pragma once
/// How fast texture coordinates change over a surface: what filtering and bending normals need.

#include "tracer/src/shapes/surface.h"

namespace tracer {

/// Trace frame, per unit of length there. What they hold across the surface means nothing.
struct UvGradients {
  Vec3 u, v;
};

/// Precondition: the scene needs textures.
UvGradients uv_gradients_at(const CompiledScene& scene, const Hit& hit, const Surface& surface);

/// The part of the texture that a square beam of side `width` along unit `direction` covers of a surface with unit
/// `normal`: sides of the rectangle that has the variance of the covered parallelogram in u and in v.
Vec2 covered_uv(const UvGradients& gradients, const Vec3& normal, const Vec3& direction, double width);

}  // namespace tracer
