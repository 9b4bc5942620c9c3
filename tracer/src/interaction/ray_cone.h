#pragma once
/// How wide a ray is: what its sample covers, carried along the path so that textures can be filtered by it.

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// A beam of square section (Amanatides 1984, "Ray Tracing with Cones"; Akenine-Moeller, Nilsson, Andersson,
/// Barre-Brisebois, Toth, Karras 2019, Ray Tracing Gems, ch. 20).
struct RayCone {
  double width = 0;   ///< of its side at the origin, trace frame; may be negative before a focus
  double spread = 0;  ///< what the side grows by per unit of length: an angle, small

  [[nodiscard]] double width_at(double distance) const { return std::abs(width + spread * distance); }
};

/// Of a sample that covers `share` of its pixel's width. The samples of a pixel together cover it once, so more of them
/// are narrower and the mean over the pixel's square stays what it is.
inline RayCone camera_cone(const CompiledScene& scene, const Vec3& direction, double share) {
  const CompiledCamera::Footprint pixel = scene.camera.pixel_footprint(direction);
  return {pixel.width * share, pixel.spread * share};
}

/// Of the surface at a hit, 1 / radius, positive where it bulges outwards: exact on spheres, of the narrower axis on
/// other round shapes, 0 on flat ones. Meshes count as flat: their images are filtered less than they might be.
double curvature_at(const CompiledScene& scene, const PrimitiveRef& primitive);

/// After a mirror of `curvature` seen from its outside (negative from its inside) at distance `t`: both rims of the
/// beam turn by twice what the normal turns between them (Ray Tracing Gems, ch. 20.3.4).
inline RayCone mirrored(const RayCone& cone, double t, double curvature) {
  const double width = cone.width + cone.spread * t;
  return {width, cone.spread + 2 * curvature * width};
}

/// After refraction, with `n` = n_from / n_to: Snell's law for small angles turns both what the beam spreads by and
/// what the normal does.
inline RayCone refracted(const RayCone& cone, double t, double curvature, double n) {
  const double width = cone.width + cone.spread * t;
  return {width, cone.spread * n + (n - 1) * curvature * width};
}

}  // namespace tracer
