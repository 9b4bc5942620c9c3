#include "api/report.h"

#include "api/estimate.h"
#include "api/src/result_json.h"
#include "tracer/version.h"

namespace api {
namespace {

/// Samples per pixel of the image, without holdout samples.
Json samples_json(const tracer::Scene& scene, const tracer::RenderStatistics& statistics) {
  const auto pixels = static_cast<double>(scene.image.window().pixels());
  return {{"min", statistics.samples_min},
          {"mean", static_cast<double>(statistics.samples - statistics.holdout_samples) / pixels},
          {"max", statistics.samples_max}};
}

/// Upper bound of the radiance that culled shadow rays omit, as a mean over all samples.
double culled_radiance(const tracer::Scene& scene, const tracer::RenderStatistics& statistics) {
  if (statistics.samples == 0) return 0;
  return static_cast<double>(statistics.culled_radiance) * 0x1p-20 * scene.accuracy.cutoff /
         static_cast<double>(statistics.samples);
}

}  // namespace

std::string write_report(const tracer::Scene& scene, const tracer::ErrorEstimate& error,
                         const tracer::RenderStatistics& statistics, const StageTimes& times,
                         std::uint64_t memory_bytes) {
  Json report = requirements_json(scene);
  report["error"] = error_json(error);
  report["samples"] = samples_json(scene, statistics);
  report["holdout_samples"] = statistics.holdout_samples;
  report["rays"] = rays_json(statistics.rays);
  report["culled_shadows"] = {{"rays", statistics.culled_shadow_rays},
                              {"radiance", culled_radiance(scene, statistics)}};
  report["time_ms"] = {{"queue", times.queue},
                       {"parse", times.parse},
                       {"build", times.build},
                       {"trace", times.trace},
                       {"encode", times.encode}};
  report["geometry_reused"] = times.cache_hits.geometry;
  report["textures"] = {{"reused", times.cache_hits.textures}, {"decoded", times.cache_hits.decoded_textures}};
  report["estimated_work"] = or_null(estimated_work(scene));
  report["memory_bytes"] = memory_bytes;
  report["non_finite"] = statistics.non_finite;
  report["build"] = tracer::build();
  return report.dump();
}

std::string write_accuracy(const tracer::Accuracy& accuracy) { return accuracy_json(accuracy).dump(); }

std::optional<ReportFigures> read_report(const std::string& report) {
  const Json json = Json::parse(report, nullptr, false);
  if (!json.is_object() || !json.contains("rays") || !json.contains("error")) return std::nullopt;
  // Members that are missing or null count as 0.
  const auto number = [&](const char* pointer) {
    const Json value = json.value(Json::json_pointer(pointer), Json());
    return value.is_number() ? value : Json(0);
  };
  const auto count = [&](const char* pointer) { return number(pointer).get<std::uint64_t>(); };
  ReportFigures figures;
  figures.rays = {count("/rays/camera"), count("/rays/shadow"), count("/rays/reflection"), count("/rays/refraction")};
  figures.cache_hits.geometry = json.value("geometry_reused", false);
  figures.cache_hits.textures = number("/textures/reused").get<std::uint32_t>();
  figures.cache_hits.decoded_textures = number("/textures/decoded").get<std::uint32_t>();
  if (const auto target = number("/error/target").get<double>(); target > 0) {
    figures.target_met = json["error"].value("met", false);
    figures.error_to_target = number("/error/estimate").get<double>() / target;
  }
  if (const auto work = number("/estimated_work").get<double>(); work > 0) {
    double ms = 0;
    for (const char* stage : {"/time_ms/build", "/time_ms/trace", "/time_ms/encode"}) ms += number(stage).get<double>();
    figures.seconds_per_work = ms / 1000 / work;
  }
  return figures;
}

}  // namespace api
