#pragma once
/// Radiance along rays that a mirror reflects: the rays of a block stay a bundle of affine forms, for flat and for
/// curved mirrors, and see one surface or the background, or are not followed.

#include <optional>
#include <vector>

#include "tracer/src/certify/occupancy.h"
#include "tracer/src/certify/shading_range.h"
#include "tracer/src/certify/surface_patch.h"

namespace tracer {

/// Radiance as forms, by channel.
using RadianceForms = std::array<AffineForm, 3>;

class MirrorBeams {
 public:
  /// `bounds` must outlive it.
  explicit MirrorBeams(const SceneBounds& bounds);

  /// Radiance that reflected rays add at the patch, times the reflectance. None if it is not known to be less than that
  /// of any ray: the reflected rays see an edge, or also a dielectric reflects them.
  [[nodiscard]] std::optional<RadianceForms> reflected(const SurfacePatch& patch, const RayBundle& rays) {
    return follow(patch, rays, 0, 1);
  }

 private:
  static constexpr std::uint32_t depth_max = 2;
  static constexpr std::size_t entries_max = 24;

  std::optional<RadianceForms> follow(const SurfacePatch& patch, const RayBundle& rays, std::uint32_t depth,
                                      double throughput);
  std::optional<RadianceForms> seen_by(const Beam& beam, const SurfacePatch& from, std::uint32_t depth,
                                       double throughput);
  std::optional<RadianceForms> surface(const SurfacePatch& patch, const RayBundle& rays, std::uint32_t depth,
                                       double throughput);
  [[nodiscard]] bool is_mirror(const SurfacePatch& patch) const;

  const SceneBounds& bounds_;
  const CompiledScene& scene_;
  Occupancy occupancy_;
  bool follows_;                                 ///< false if no scene feature allows it
  std::vector<Occupancy::Entry> all_, entries_;  ///< the scene, and what a beam may hit
  std::vector<Interval> visible_;                ///< by light
};

}  // namespace tracer
