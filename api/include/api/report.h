#pragma once
/// The `report` of a finished job (api/docs/http.md), as JSON text.

#include <cstdint>
#include <optional>
#include <string>

#include "tracer/compile.h"
#include "tracer/render.h"
#include "tracer/requirements.h"
#include "tracer/scene.h"

namespace api {

/// Wall-clock milliseconds of each stage. `queue` is set by the service (0 on the command line).
struct StageTimes {
  double queue = 0, parse = 0, build = 0, trace = 0, encode = 0;
  tracer::CacheHits cache_hits{};  ///< results of earlier jobs that shortened `parse` and `build`
};

/// {requirements, reasons, error{estimate, confidence, target, met, bounded, parts{sampling, depth, cutoff,
/// approximation}}, samples{min, mean, max}, holdout_samples, rays{camera, shadow, reflection, refraction},
/// culled_shadows{rays, radiance}, time_ms{...}, geometry_reused, textures{reused, decoded}, estimated_work,
/// memory_bytes, non_finite, build}. `target` is null without a target error; `samples` are those of the image, without
/// `holdout_samples`. Precondition: tracer::validate accepts `scene`. Throws std::bad_alloc only.
std::string write_report(const tracer::Scene& scene, const tracer::ErrorEstimate& error,
                         const tracer::RenderStatistics& statistics, const StageTimes& times,
                         std::uint64_t memory_bytes);

/// The accuracy as the "accuracy" section of a document: the target error instead of a preset, and no defaults. The
/// section reads back as the same accuracy. Throws std::bad_alloc only.
std::string write_accuracy(const tracer::Accuracy& accuracy);

/// The members of a report that metrics are computed from.
struct ReportFigures {
  tracer::RayCounts rays;
  std::optional<bool> target_met;          ///< unset without a target error
  std::optional<double> seconds_per_work;  ///< building, tracing and encoding, per estimated_work (api/estimate.h)
  std::optional<double> error_to_target;   ///< error estimate / target error; unset without a target error
  tracer::CacheHits cache_hits;
};
/// Unset if the text is not a report of write_report.
std::optional<ReportFigures> read_report(const std::string& report);

}  // namespace api
