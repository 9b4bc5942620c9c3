#pragma once
/// Ray cones: the footprint of a sample, propagated along the path to filter textures.

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// A beam of square section (Amanatides 1984, "Ray Tracing with Cones"; Akenine-Moeller, Nilsson, Andersson,
/// Barre-Brisebois, Toth, Karras 2019, Ray Tracing Gems, ch. 20).
struct RayCone {
  double width = 0;   ///< side length at the origin, render space; may be negative before a focus
  double spread = 0;  ///< growth of the side per unit of length, a small angle

  [[nodiscard]] double width_at(double distance) const { return std::abs(width + spread * distance); }
};

/// Cone of a sample that covers the fraction `share` of its pixel's width. The samples of a pixel cover it once
/// together, so that the mean over the pixel does not depend on their number.
inline RayCone camera_cone(const CompiledScene& scene, const Vec3& direction, double share) {
  const CompiledCamera::Footprint pixel = scene.camera.pixel_footprint(direction);
  return {pixel.width * share, pixel.spread * share};
}

/// After reflection at distance `t` with `curvature` on the incident side: the edges of the cone turn by twice the
/// angle between their normals (Ray Tracing Gems, ch. 20.3.4).
inline RayCone reflected_cone(const RayCone& cone, double t, double curvature) {
  const double width = cone.width + cone.spread * t;
  return {width, cone.spread + 2 * curvature * width};
}

/// After refraction with `n` = n_from / n_to, by Snell's law for small angles.
inline RayCone refracted_cone(const RayCone& cone, double t, double curvature, double n) {
  const double width = cone.width + cone.spread * t;
  return {width, cone.spread * n + (n - 1) * curvature * width};
}

}  // namespace tracer
