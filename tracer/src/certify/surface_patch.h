#pragma once
/// The part of a surface that a bundle of rays hits: position and normal as functions of the position in the block.

#include "tracer/src/certify/ray_bundle.h"
#include "tracer/src/certify/scene_bounds.h"

namespace tracer {

struct SurfacePatch {
  PrimitiveRef primitive;
  std::uint32_t material = 0;
  bool has_normal = true;  ///< false: the shading normal may have any direction
  AffineVec position;
  AffineVec shadow_start;  ///< point that shadow rays start near
  AffineVec normal;        ///< unit shading normal on the incident side
  bool convex = false;     ///< the surface bends away from its geometric normal everywhere: it does not shadow itself
  Vec3 anchor{}, face{};   ///< a point and the unit normal of a triangle's plane, on the incident side
};

/// Precondition: `hit` covers the bundle.
SurfacePatch surface_patch(const SceneBounds& bounds, const PrimitiveRef& primitive, const RayBundle& rays,
                           const BundleHit& hit);

}  // namespace tracer
