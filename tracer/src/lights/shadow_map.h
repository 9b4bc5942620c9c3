#pragma once
/// Shadow maps: depths of the scene from a light, tested instead of tracing shadow rays (Williams 1978, "Casting Curved
/// Shadows on Curved Surfaces"). They contain opaque surfaces only: transmissive ones cast no shadow. The map of an
/// area light is rendered from its center, so its shadow is as sharp as that of a point.

#include <cstdint>
#include <vector>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// One projection of the scene. Depths are along the forward axis; the ray of a texel passes through its center.
struct ShadowFace {
  Vec3 origin;  ///< the light, or the center of the scene if its rays are parallel
  Axes axes;    ///< e0 to the right, e1 up, n forward
  bool parallel = false;
  double reach = 1;          ///< half the side of the window; not parallel: at depth one
  double base = 0;           ///< offset of the stored depths, which keeps their digits in float
  std::uint32_t side = 0;    ///< texels
  std::vector<float> depth;  ///< side * side, relative to `base`; infinity without a surface

  struct Ray {
    Vec3 origin, step;  ///< `step` reaches one unit of depth; not unit
  };
  [[nodiscard]] Ray ray(std::uint32_t column, std::uint32_t row) const {
    const auto offset = [this](std::uint32_t texel) { return reach * ((2.0 * texel + 1) / side - 1); };
    const Vec3 aside = axes.e0 * offset(column) + axes.e1 * offset(row);
    return parallel ? Ray{origin + aside, axes.n} : Ray{origin, axes.n + aside};
  }
};

/// A light without faces is unoccluded; so are points outside of the windows of all faces.
struct ShadowMap {
  std::vector<ShadowFace> faces;

  /// Returns true if no finite surface is nearer to the light than the plane through `point` with unit `normal`: the
  /// texel's ray hits a flat surface exactly in that plane at any slope, so no bias is needed. A tolerance of a texel's
  /// width at that depth is left for curved surfaces.
  [[nodiscard]] bool lit(const Vec3& point, const Vec3& normal) const;
};

/// Returns true if an opaque plane other than `from` lies within `distance` from `origin` along unit `direction`.
/// Planes are infinite, so they are not in the maps.
bool plane_between(const GeometrySet& geometry, const Vec3& origin, const Vec3& direction, double distance,
                   const PrimitiveRef& from);

}  // namespace tracer
