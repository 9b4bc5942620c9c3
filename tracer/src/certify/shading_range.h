#pragma once
/// Range of the radiance that a surface patch sends to the camera.

#include <span>

#include "tracer/src/certify/scene_bounds.h"
#include "tracer/src/certify/surface_patch.h"

namespace tracer {

/// Radiance of a patch along the rays of the bundle, without what secondary rays add: emission, ambient and direct
/// light. `width` is the largest width of a pixel's ray at the patch, `visible` the shadow_range() of each light.
ColorInterval local_radiance(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays, double width,
                             std::span<const Interval> visible);

/// The same at any point of any object with this material that is at least `distance` (scene units) away from every
/// light that has a position.
ColorInterval local_radiance(const SceneBounds& bounds, std::uint32_t material, double distance);

/// Factors of the radiance along secondary rays: upper bounds, by channel.
struct SecondaryFactors {
  Color reflection, transmission;
  Color total;  ///< reflection and transmission together
};
SecondaryFactors secondary_factors(const CompiledMaterial& material);

/// `local` with what secondary rays of any radiance add.
ColorInterval with_secondary_rays(const SceneBounds& bounds, std::uint32_t material, ColorInterval local);

}  // namespace tracer
