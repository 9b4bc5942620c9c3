#pragma once
/// Range of the radiance that a surface patch sends to the camera.

#include <span>

#include "tracer/src/certify/scene_bounds.h"
#include "tracer/src/certify/surface_patch.h"

namespace tracer {

/// Radiance of a patch without what secondary rays add, over the positions of its block.
struct LocalRadiance {
  ColorInterval emitted_ambient{};
  std::array<AffineForm, 3> light{};  ///< direct light
  std::array<double, 3> light_max{};  ///< bound of `light` that does not depend on positions
  bool any_light = false;

  /// Width of the range that remains for the smallest part of the block, relative to the larger end of the range or to
  /// `dark`. An eighth of the linear part in each of `side` x `side` parts does not count.
  [[nodiscard]] double nonlinear_width(double dark, double side) const;
};

/// `width` is the largest width of a pixel's ray at the patch, `visible` the shadow_range() of each light.
LocalRadiance local_radiance(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays, double width,
                             std::span<const Interval> visible);

/// Range over a part of the block.
ColorInterval range_of(const SceneBounds& bounds, const LocalRadiance& radiance, const BlockPart& part);

/// Range at any point of any object with this material that is at least `distance` (scene units) away from every
/// light that has a position.
ColorInterval local_radiance(const SceneBounds& bounds, std::uint32_t material, double distance);

/// Upper bound, by channel, of the factor of the radiance along secondary rays, reflected and transmitted ones
/// together.
Color secondary_factor(const SceneBounds& bounds, std::uint32_t material);

/// `local` with what secondary rays of any radiance add.
ColorInterval with_secondary_rays(const SceneBounds& bounds, std::uint32_t material, ColorInterval local);

}  // namespace tracer
