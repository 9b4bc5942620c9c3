#pragma once
/// Audit of the light of patches: its error where surfaces face each other, measured by paths, and the part by chance.
/// It depends on no view, so that scenes that differ in the view share it. The error of an image is measured later.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "tracer/control.h"
#include "tracer/src/compile/patch_points.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/display/display_transform.h"
#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/sampling/pixel_sums.h"

namespace tracer {

/// Squared errors in squared levels, means over the looks and the channels.
struct AuditedError {
  double squared = 0;  ///< error of the light of patches; negative by chance
  double chance = 0;   ///< part of it by the finite number of rays in each row
};

/// The looks and their paths are the same in every call, so that errors of different patches can be compared.
class RadiosityAudit {
 public:
  /// Without a time budget there are so many paths that their noise is at most some 0.5 of `squared_target`: closer to
  /// it, either decision is as good. The scene and `control` must outlive the audit. Throws std::bad_alloc.
  RadiosityAudit(const CompiledScene& scene, const PatchPoints& surfaces, double squared_target,
                 RenderControl& control);

  /// Measures the error of `radiosity`, which the scene must hold. Changes `radiosity.arriving` meanwhile. Meaningless
  /// after cancellation. Throws std::bad_alloc.
  AuditedError measure(Radiosity& radiosity);

  /// Rays of all exact paths so far, and those that a pixel would take to reach the target by paths.
  [[nodiscard]] std::uint64_t rays() const { return exact_pool_.statistics().rays.total(); }
  [[nodiscard]] double rays_by_paths() const { return noise_ / squared_target_ * rays_of_path_; }

 private:
  using Found = std::vector<std::optional<Halves>>;
  using Pool = TracerPool<Wavefront<AllFeatures>>;
  struct Distance {
    double squared = 0, noise = 0;  ///< see HalvesDistance; means over the looks and channels
  };
  /// Exact samples of each look. Approximate ones have the same random choices as `few`, which cancel.
  Found trace_exact(const Found& few);
  /// The halves of each look, of `half` samples each.
  Found trace(Pool& pool, std::uint32_t half) const;
  [[nodiscard]] DisplayTransform display_of(const Found& found) const;
  [[nodiscard]] Distance distance(const Found& a, const Found& b, const Found& values,
                                  const DisplayTransform& display) const;

  const CompiledScene& scene_;
  const double squared_target_;
  RenderControl& control_;
  const RayQueue looks_;
  Found exact_;
  Pool exact_pool_, pool_;
  double rays_of_path_ = 0;
  /// The most that a look counts, for a few dark corners must not decide: the square of some four times the target
  /// error, or any if so much is noise.
  double look_most_ = std::numeric_limits<double>::infinity();
  double noise_ = 0;  ///< variance of a path, as if its mean over n paths had 1 / n of it
};

}  // namespace tracer
