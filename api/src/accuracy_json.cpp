#include "api/src/accuracy_json.h"

#include <string>

namespace api {
namespace {

using Json = nlohmann::ordered_json;
using tracer::Approximations;

Json approximations_json(const Approximations& by) {
  Json json = Json::object();
  if (by.shadows == Approximations::Shadows::none) json["shadows"] = "none";
  if (by.shadows == Approximations::Shadows::map) json["shadows"] = "map";
  if (by.reflections == Approximations::Reflections::environment) json["reflections"] = "environment";
  if (by.reflections == Approximations::Reflections::none) json["reflections"] = "none";
  if (by.shading == Approximations::Shading::gouraud) json["shading"] = "gouraud";
  if (by.shading == Approximations::Shading::flat) json["shading"] = "flat";
  if (by.nearest_lights != 0) json["lights"] = "nearest-" + std::to_string(by.nearest_lights);
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
    const tracer::Adaptive& adaptive = *accuracy.adaptive;
    if (adaptive.time_budget_ms) json["time_budget_ms"] = *adaptive.time_budget_ms;
    if (adaptive.samples_min != tracer::Adaptive().samples_min ||
        adaptive.samples_max != tracer::Adaptive().samples_max)
      json["samples"] = {adaptive.samples_min, adaptive.samples_max};
  }
  if (accuracy.max_depth != usual.max_depth) json["max_depth"] = accuracy.max_depth;
  // Naming it is what switches chance off where samples adapt.
  const bool by_chance_unless_named = accuracy.adaptive.has_value();
  if (accuracy.cutoff != usual.cutoff || accuracy.cutoff_by_chance != by_chance_unless_named)
    json["cutoff"] = accuracy.cutoff;
  if (accuracy.seed != 0) json["seed"] = accuracy.seed;
  if (accuracy.approximate.any()) json["approximate"] = approximations_json(accuracy.approximate);
  return json;
}

}  // namespace api
