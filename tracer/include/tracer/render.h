#pragma once
/// Traces a compiled scene into an image.

#include <cstdint>
#include <functional>
#include <memory>

#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/image.h"
#include "tracer/preview.h"
#include "tracer/requirements.h"
#include "tracer/result.h"

namespace tracer {

/// Rays by kind, exactly as many as were traced. `shadow` counts each light's ray once, however many surfaces it
/// crosses. Those of shadow maps are part of the build, and not among them.
struct RayCounts {
  std::uint64_t camera = 0, shadow = 0, reflection = 0, refraction = 0;
  [[nodiscard]] std::uint64_t total() const { return camera + shadow + reflection + refraction; }
  bool operator==(const RayCounts&) const = default;
};

/// What was done, for the report. The tracer reads no clock: times are the caller's.
struct RenderStatistics {
  RayCounts rays;
  std::uint64_t samples = 0;                       ///< camera samples over all pixels
  std::uint32_t samples_min = 0, samples_max = 0;  ///< in any pixel
  /// Of `samples`, those which only estimate the error and are in no pixel's mean.
  std::uint64_t holdout_samples = 0;
  std::uint64_t non_finite = 0;  ///< samples that came out NaN or infinite; left out of their pixel's mean. Must be 0
  /// Shadow rays not traced because what their lights could give, together with the others left out at the same hit, is
  /// within `cutoff`; only of scenes with many lights.
  std::uint64_t culled_shadow_rays = 0;
  /// What is missing for that at most, summed over all samples: the largest channel, in 2^-20 of `cutoff`, each hit's
  /// rounded up. (Whole numbers, so that the order of the sum does not matter.)
  std::uint64_t culled_radiance = 0;
  std::uint64_t cut_branches = 0;        ///< branches not traced because of `cutoff`
  std::uint64_t truncated_branches = 0;  ///< branches not traced because of `max_depth`
  bool operator==(const RenderStatistics&) const = default;
};

struct Rendered {
  Image image;
  ErrorEstimate error;
  RenderStatistics statistics;
};

struct RenderSettings {
  /// Milliseconds since the work on this image began, its build included; any thread may ask. Needed by a time
  /// budget, which is none without it: the tracer has no clock of its own.
  std::function<double()> elapsed_ms{};
  /// Threads to use; 0: those of the calling thread's oneTBB arena. The image and the statistics are bit-identical
  /// for any number.
  std::uint32_t threads = 0;
  Preview* preview = nullptr;  ///< who may look on; null: nobody. Changes nothing of the image.
};

/// May run many times, on any threads. Fails with `cancelled` within one tile's time of `control.cancel()`,
/// with `out_of_memory` when the heap does. Equal scenes give bit-identical images, but for a time budget.
Result<Rendered, Failure> render(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control);

}  // namespace tracer
