#pragma once
/// Renders a compiled scene.

#include <cstdint>
#include <functional>

#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/image.h"
#include "tracer/requirements.h"
#include "tracer/result.h"

namespace tracer {

/// Number of rays traced, by kind. `shadow` counts one ray per sample of a light or of a glowing surface, regardless of
/// the transmissive surfaces it passes. Rays of shadow maps belong to compile() and are not counted.
struct RayCounts {
  std::uint64_t camera = 0, shadow = 0, reflection = 0, refraction = 0, diffuse = 0;
  [[nodiscard]] std::uint64_t total() const { return camera + shadow + reflection + refraction + diffuse; }
  bool operator==(const RayCounts&) const = default;
};
inline constexpr std::pair<const char*, std::uint64_t RayCounts::*> ray_kinds[] = {
    {"camera", &RayCounts::camera},
    {"shadow", &RayCounts::shadow},
    {"reflection", &RayCounts::reflection},
    {"refraction", &RayCounts::refraction},
    {"diffuse", &RayCounts::diffuse}};

/// Counters of one render. The tracer reads no clock: times are measured by the caller.
struct RenderStatistics {
  RayCounts rays;
  std::uint64_t samples = 0;                       ///< camera samples over all pixels
  std::uint32_t samples_min = 0, samples_max = 0;  ///< over all pixels
  std::uint64_t holdout_samples = 0;  ///< part of `samples` that only validates the error estimate, not in any mean
  std::uint64_t non_finite = 0;  ///< NaN or infinite samples, omitted from their pixel's mean; 0 unless there is a bug
  /// Shadow rays not traced because the radiance of their lights, summed over the lights culled at the same hit, is
  /// within `cutoff`, or by chance without one. Only in scenes with many lights.
  std::uint64_t culled_shadow_rays = 0;
  /// Upper bound of the radiance omitted with them, summed over all samples: maximum over RGB, in units of
  /// 2^-20 `cutoff`, rounded up per hit; 0 without it. An integer, so the order of summation does not matter.
  std::uint64_t culled_radiance = 0;
  /// Shapes, and triangles of meshes, that equal an earlier one and are left out: no ray hits them. In lists of more
  /// than 4,096 they are left out if a sample of one in 16 has equal ones.
  std::uint64_t duplicates = 0;
  std::uint64_t cut_branches = 0;        ///< secondary rays not traced because of `cutoff` or by chance
  std::uint64_t truncated_branches = 0;  ///< secondary rays not traced because of `max_depth`
  bool operator==(const RenderStatistics&) const = default;
};

struct Rendered {
  Image image;
  ErrorEstimate error;
  RenderStatistics statistics;
};

class PartExchange;

struct RenderSettings {
  /// Milliseconds since the work on this image began, compile() included; called from any thread. A time budget has no
  /// effect without it.
  std::function<double()> elapsed_ms{};
  /// Number of threads; 0: those of the calling thread's oneTBB arena. Image and statistics are bit-identical for any
  /// number.
  std::uint32_t threads = 0;
  Preview* preview = nullptr;  ///< receives the image in progress; null: none. Does not change the image.
  /// Has parts of the samples traced elsewhere (parts.h); null: none. Does not change the image.
  PartExchange* exchange = nullptr;
};

/// May run many times, on any threads. Equal scenes give bit-identical images, except with a time budget. Fails with
/// `cancelled` within one tile's time of `control.cancel()`, and with `out_of_memory`.
Result<Rendered, Failure> render(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control);

}  // namespace tracer
