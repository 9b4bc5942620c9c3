#pragma once
/// What a light sees, kept as depths on a grid: asked instead of a shadow ray (Williams 1978, "Casting Curved Shadows
/// on Curved Surfaces"). Of opaque surfaces alone: what lets light through casts no shadow. A soft light sees from its
/// middle, so its shadow is as sharp as a point's.

#include <cstdint>
#include <vector>

#include "tracer/src/accel/geometry.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// One window that the light looks through. Depths are along `forward`; the ray of a texel goes through its centre.
struct ShadowFace {
  Vec3 origin;  ///< the light; where its rays are parallel, the middle of what they fall on
  Axes axes;    ///< e0 to the right, e1 up, n forward
  bool parallel = false;
  double reach = 1;          ///< half the window's side; not parallel: at depth one
  double base = 0;           ///< what the stored depths are relative to, so that floats hold them well
  std::uint32_t side = 0;    ///< texels
  std::vector<float> depth;  ///< side * side, relative to `base`; infinity where nothing is

  struct Ray {
    Vec3 origin, step;  ///< `step` reaches one unit of depth; not unit
  };
  [[nodiscard]] Ray ray(std::uint32_t column, std::uint32_t row) const {
    const auto offset = [this](std::uint32_t texel) { return reach * ((2.0 * texel + 1) / side - 1); };
    const Vec3 aside = axes.e0 * offset(column) + axes.e1 * offset(row);
    return parallel ? Ray{origin + aside, axes.n} : Ray{origin, axes.n + aside};
  }
};

/// Nothing is in the way of a light without faces; nothing finite beyond the windows of one that has some.
struct ShadowMap {
  std::vector<ShadowFace> faces;

  /// Whether no finite surface is nearer to the light than the plane through `point` across unit `normal`: what the
  /// texel's ray meets of a flat surface is exactly there, however slanted it is, so no slope needs a bias. A texel's
  /// width at that depth is left for surfaces that bend away from their plane.
  [[nodiscard]] bool lit(const Vec3& point, const Vec3& normal) const;
};

/// Whether an opaque plane crosses the first `distance` from `origin` along unit `direction`, other than the one that
/// the way begins on. Planes have no end: no window holds them.
bool plane_between(const GeometrySet& geometry, const Vec3& origin, const Vec3& direction, double distance,
                   const PrimitiveRef& from);

}  // namespace tracer
