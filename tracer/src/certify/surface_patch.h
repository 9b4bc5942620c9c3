#pragma once
/// The part of a surface that a bundle of rays hits: position, normals and colors as functions of the position in the
/// block.

#include <array>

#include "tracer/src/certify/ray_bundle.h"

namespace tracer {

struct SurfacePatch {
  PrimitiveRef primitive;
  std::uint32_t object = 0, material = 0;
  bool back = false;
  bool has_normal = true;  ///< false: the shading normal may have any direction
  AffineVec hit;           ///< point on the surface
  AffineVec position;      ///< point that lights are evaluated at
  AffineVec shadow_start;  ///< point that shadow rays start near
  bool offset = false;     ///< `shadow_start` differs from `hit` by more than rounding
  AffineVec normal;        ///< unit shading normal on the incident side
  AffineVec face;          ///< geometric normal on the incident side, of any length
  bool convex = false;     ///< the surface bends away from `face` everywhere: it does not shadow itself
  /// A flat patch with its own normal: N.L |l - p| = normal.(l - anchor) is the same at all of its points.
  bool flat = false;
  Vec3 anchor{}, flat_normal{};
  QuadricPart part{};
  AffineForm u{}, v{};  ///< barycentric coordinates of a triangle
};

/// With exact shading and with `approximate`. Precondition: `hit` covers the bundle.
SurfacePatch surface_patch(const CompiledScene& scene, const PrimitiveRef& primitive, const RayBundle& rays,
                           const BundleHit& hit, Approximations::Shading approximate);

}  // namespace tracer
