#include "api/report.h"

#include <nlohmann/json.hpp>

#include "api/estimate.h"
#include "api/src/accuracy_json.h"
#include "api/src/error_json.h"
#include "api/src/requirements_json.h"
#include "tracer/version.h"

namespace api {
namespace {

using Json = nlohmann::ordered_json;

/// Those that are in the image.
Json write_samples(const tracer::Scene& scene, const tracer::RenderStatistics& statistics) {
  const auto pixels = static_cast<double>(scene.image.window().pixels());
  return {{"min", statistics.samples_min},
          {"mean", static_cast<double>(statistics.samples - statistics.holdout_samples) / pixels},
          {"max", statistics.samples_max}};
}

/// What a sample misses at most because of shadow rays that were spared, as a mean over all.
double culled_radiance(const tracer::Scene& scene, const tracer::RenderStatistics& statistics) {
  if (statistics.samples == 0) return 0;
  return static_cast<double>(statistics.culled_radiance) * 0x1p-20 * scene.accuracy.cutoff /
         static_cast<double>(statistics.samples);
}

}  // namespace

std::string write_report(const tracer::Scene& scene, const tracer::ErrorEstimate& error,
                         const tracer::RenderStatistics& statistics, const StageTimes& times,
                         std::uint64_t memory_bytes) {
  std::vector<tracer::RequirementReason> reasons;
  const tracer::Requirements needs = tracer::requirements(scene, &reasons);
  const std::optional<double> work = estimated_work(scene);
  const Json report = {
      {"requirements", requirements_json(needs)},
      {"reasons", reasons_json(reasons)},
      {"error", error_json(error)},
      {"samples", write_samples(scene, statistics)},
      {"holdout_samples", statistics.holdout_samples},
      {"rays", rays_json(statistics.rays)},
      {"culled_shadows", {{"rays", statistics.culled_shadow_rays}, {"radiance", culled_radiance(scene, statistics)}}},
      {"time_ms",
       {{"queue", times.queue},
        {"parse", times.parse},
        {"build", times.build},
        {"trace", times.trace},
        {"encode", times.encode}}},
      {"geometry_reused", times.cache_hits.geometry},
      {"textures", {{"reused", times.cache_hits.textures}, {"decoded", times.cache_hits.decoded_textures}}},
      {"estimated_work", work ? Json(*work) : Json(nullptr)},
      {"memory_bytes", memory_bytes},
      {"non_finite", statistics.non_finite},
      {"build", tracer::build()}};
  return report.dump();
}

std::string write_accuracy(const tracer::Accuracy& accuracy) { return accuracy_json(accuracy).dump(); }

std::optional<ReportFigures> read_report(const std::string& report) {
  const Json json = Json::parse(report, nullptr, false);
  if (!json.is_object() || !json.contains("rays") || !json.contains("error")) return std::nullopt;
  ReportFigures figures;
  const Json& rays = json["rays"];
  figures.rays = {rays.value("camera", std::uint64_t{0}), rays.value("shadow", std::uint64_t{0}),
                  rays.value("reflection", std::uint64_t{0}), rays.value("refraction", std::uint64_t{0})};
  figures.cache_hits.geometry = json.value("geometry_reused", false);
  if (json.contains("textures")) {
    figures.cache_hits.textures = json["textures"].value("reused", 0u);
    figures.cache_hits.decoded_textures = json["textures"].value("decoded", 0u);
  }
  const Json& error = json["error"];
  if (error.contains("target") && error["target"].is_number()) {
    figures.target_met = error.value("met", false);
    figures.error_to_target = error.value("estimate", 0.0) / error["target"].get<double>();
  }
  if (json.contains("estimated_work") && json["estimated_work"].is_number() && json.contains("time_ms")) {
    const Json& time_ms = json["time_ms"];
    const double ms = time_ms.value("build", 0.0) + time_ms.value("trace", 0.0) + time_ms.value("encode", 0.0);
    figures.seconds_per_work = ms / 1000 / json["estimated_work"].get<double>();
  }
  return figures;
}

}  // namespace api
