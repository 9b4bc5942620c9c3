#pragma once
/// Ranges of the radiance of camera rays, with all that the integrator applies to them: depth cue, absorption around
/// the camera, and transparency.

#include <optional>
#include <span>

#include "tracer/src/certify/mirror_beams.h"
#include "tracer/src/certify/scene_bounds.h"
#include "tracer/src/certify/shading_range.h"
#include "tracer/src/certify/surface_patch.h"

namespace tracer {

/// Camera rays of a block that hit nothing, or one surface: functions of the positions in the block.
struct EscapedRays {
  AffineForm height;  ///< cosine to the direction of a gradient, or 0
};
struct SurfaceRays {
  LocalRadiance local;
  AffineForm depth;  ///< along the viewing axis
  std::uint32_t material = 0;
  std::optional<RadianceForms> reflected{};  ///< radiance that secondary rays add, if they are followed

  /// See LocalRadiance::nonlinear_width().
  [[nodiscard]] double nonlinear_width(double dark, double side) const;
};

class BlockRadiance {
 public:
  /// The scene must outlive it. `eye`: of an anaglyph. Throws std::bad_alloc.
  BlockRadiance(const CompiledScene& compiled, const Approximations& approximate, const RenderControl& control,
                std::size_t eye);

  [[nodiscard]] const SceneBounds& bounds() const { return bounds_; }
  /// Rays about an image position. None for a panorama with a lens: all pixels then have the range anything().
  [[nodiscard]] std::optional<CompiledCamera::LinearRays> rays(double x, double y) const {
    return scene_.camera.linear_rays(x, y, scene_.needs.lens, eye_);
  }

  /// Rays that hit nothing.
  [[nodiscard]] EscapedRays escaped(const RayBundle& rays) const;
  [[nodiscard]] ColorInterval range(const EscapedRays& rays, const BlockPart& part) const;
  /// Rays that hit the patch; `visible` is the shadow_range() of each light.
  [[nodiscard]] SurfaceRays surface(const SurfacePatch& patch, const RayBundle& rays,
                                    std::span<const Interval> visible) const;
  [[nodiscard]] ColorInterval range(const SurfaceRays& rays, const BlockPart& part) const;
  /// Rays that hit the primitive anywhere.
  [[nodiscard]] ColorInterval primitive(const PrimitiveRef& primitive) const;
  /// Any ray.
  [[nodiscard]] ColorInterval anything() const;

 private:
  [[nodiscard]] ColorInterval finished(ColorInterval radiance, const Interval& cue_scale) const;
  [[nodiscard]] Interval any_cue_scale() const;

  SceneBounds bounds_;
  const CompiledScene& scene_;
  std::size_t eye_;
  CompiledCamera::LinearRays rays_;       ///< at the image's corner
  std::vector<ColorInterval> materials_;  ///< radiance of any of their points, by material
};

}  // namespace tracer
