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

/// Times are wall-clock milliseconds of each stage. `queue` is added by whoever knows it (0 on the command line).
struct StageTimes {
  double queue = 0, parse = 0, build = 0, trace = 0, encode = 0;
  tracer::CacheHits cache_hits{};  ///< what earlier jobs left: `parse` and `build` were short
};

/// {requirements, reasons, error{estimate, confidence, target, met, bounded, parts{sampling, depth, cutoff,
/// approximation}}, samples{min,mean,max}, holdout_samples, rays{camera,shadow,reflection,refraction}, time_ms{...},
/// geometry_reused, images{reused,decoded}, estimated_work, memory_bytes, non_finite, build}. `target` is null where
/// none was asked for; `samples` are those that the image is the mean of, `holdout_samples` the others. Precondition:
/// `scene` passes tracer::validate. Throws std::bad_alloc only.
std::string write_report(const tracer::Scene& scene, const tracer::ErrorEstimate& error,
                         const tracer::RenderStatistics& statistics, const StageTimes& times,
                         std::uint64_t memory_bytes);

/// What a document asks for with this accuracy, as its "accuracy" section: a preset by its target, only what is not the
/// default otherwise. Read again, it gives the same accuracy. Throws std::bad_alloc only.
std::string write_accuracy(const tracer::Accuracy& accuracy);

/// What figures are made of, of a report that write_report wrote.
struct ReportFigures {
  tracer::RayCounts rays;
  std::optional<bool> target_met;          ///< nothing where no error was asked for
  std::optional<double> seconds_per_work;  ///< of building, tracing and encoding, by estimated_work (api/estimate.h)
  std::optional<double> error_to_target;   ///< the error that is claimed over the one asked for; likewise
  tracer::CacheHits cache_hits;
};
/// Nothing where it is none.
std::optional<ReportFigures> read_report(const std::string& report);

}  // namespace api
