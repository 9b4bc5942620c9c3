#include "api/src/result_json.h"

#include <string>
#include <utility>

namespace api {
namespace {

using tracer::Approximations;
using tracer::ErrorEstimate;
using tracer::RayCounts;

constexpr std::pair<const char*, double ErrorEstimate::*> error_parts[] = {
    {"sampling", &ErrorEstimate::sampling},
    {"depth", &ErrorEstimate::depth},
    {"cutoff", &ErrorEstimate::cutoff},
    {"approximation", &ErrorEstimate::approximation}};
constexpr std::pair<const char*, std::uint64_t RayCounts::*> ray_kinds[] = {{"camera", &RayCounts::camera},
                                                                            {"shadow", &RayCounts::shadow},
                                                                            {"reflection", &RayCounts::reflection},
                                                                            {"refraction", &RayCounts::refraction}};

Json approximations_json(const Approximations& approximate) {
  Json json = Json::object();
  if (approximate.shadows == Approximations::Shadows::none) json["shadows"] = "none";
  if (approximate.shadows == Approximations::Shadows::map) json["shadows"] = "map";
  if (approximate.reflections == Approximations::Reflections::environment) json["reflections"] = "environment";
  if (approximate.reflections == Approximations::Reflections::none) json["reflections"] = "none";
  if (approximate.shading == Approximations::Shading::gouraud) json["shading"] = "gouraud";
  if (approximate.shading == Approximations::Shading::flat) json["shading"] = "flat";
  if (approximate.nearest_lights != 0) json["lights"] = "nearest-" + std::to_string(approximate.nearest_lights);
  return json;
}

}  // namespace

Json accuracy_json(const tracer::Accuracy& accuracy) {
  const tracer::Accuracy usual;
  Json json = Json::object();
  if (const auto target = accuracy.target()) json["target_error"] = *target;
  if (!accuracy.adaptive) {
    json["samples"] = {accuracy.samples, accuracy.samples};
  } else {
    const tracer::Adaptive &adaptive = *accuracy.adaptive, usual_adaptive;
    if (adaptive.time_budget_ms) json["time_budget_ms"] = *adaptive.time_budget_ms;
    if (adaptive.samples_min != usual_adaptive.samples_min || adaptive.samples_max != usual_adaptive.samples_max)
      json["samples"] = {adaptive.samples_min, adaptive.samples_max};
  }
  if (accuracy.max_depth != usual.max_depth) json["max_depth"] = accuracy.max_depth;
  // Without the field, adaptive sampling ends rays by Russian roulette.
  if (accuracy.cutoff != usual.cutoff || accuracy.cutoff_by_chance != accuracy.adaptive.has_value())
    json["cutoff"] = accuracy.cutoff;
  if (accuracy.seed != 0) json["seed"] = accuracy.seed;
  if (accuracy.approximate.any()) json["approximate"] = approximations_json(accuracy.approximate);
  return json;
}

Json error_json(const ErrorEstimate& error) {
  Json json = {{"estimate", error.estimate},
               {"confidence", error.confidence},
               {"target", or_null(error.target)},
               {"met", error.target_met},
               {"bounded", error.bounded}};
  for (const auto& [name, part] : error_parts) json["parts"][name] = error.*part;
  return json;
}

ErrorEstimate error_of_json(const Json& json) {
  ErrorEstimate error;
  json.at("estimate").get_to(error.estimate);
  json.at("confidence").get_to(error.confidence);
  if (!json.at("target").is_null()) error.target = json.at("target").get<double>();
  json.at("met").get_to(error.target_met);
  json.at("bounded").get_to(error.bounded);
  for (const auto& [name, part] : error_parts) json.at("parts").at(name).get_to(error.*part);
  return error;
}

Json rays_json(const RayCounts& rays) {
  Json json;
  for (const auto& [name, count] : ray_kinds) json[name] = rays.*count;
  return json;
}

RayCounts rays_of_json(const Json& json) {
  RayCounts rays;
  for (const auto& [name, count] : ray_kinds) json.at(name).get_to(rays.*count);
  return rays;
}

}  // namespace api
