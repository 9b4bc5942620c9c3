#include "api/src/result_json.h"

#include <array>
#include <limits>
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
    {"approximation", &ErrorEstimate::approximation},
    {"approximation_min", &ErrorEstimate::approximation_min},
    {"tone", &ErrorEstimate::tone}};
/// In the order of ErrorEstimate::Limit.
constexpr std::array<const char*, 6> limit_names{nullptr,       "target",      "time_budget",
                                                 "samples_max", "fixed_parts", "invisible"};

Json approximations_json(const Approximations& approximate) {
  Json json = Json::object();
  tracer::for_each_field<Approximations>([&](const auto& field) {
    const auto value = approximate.*field.member;
    if constexpr (std::is_enum_v<decltype(value)>) {
      for (const auto& [word, meaning] : tracer::words<std::remove_const_t<decltype(value)>>)
        if (value == meaning) json[std::string(field.name)] = word;
    } else if (value > 0) {
      json[std::string(field.name)] = value;
    }
  });
  if (approximate.nearest_lights != 0) json["lights"] = "nearest-" + std::to_string(approximate.nearest_lights);
  return json;
}

Json limit_json(ErrorEstimate::Limit limit) {
  const char* const name = limit_names[static_cast<std::size_t>(limit)];
  return name == nullptr ? Json(nullptr) : Json(name);
}

ErrorEstimate::Limit limit_of(const Json& json) {
  if (json.is_null()) return ErrorEstimate::Limit::none;
  const auto name = json.get<std::string>();
  for (std::size_t i = 1; i < limit_names.size(); ++i)
    if (name == limit_names[i]) return static_cast<ErrorEstimate::Limit>(i);
  throw Json::other_error::create(501, "unknown limit " + name, &json);
}

std::optional<double> number_or_none(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

}  // namespace

Json accuracy_json(const tracer::Accuracy& accuracy) {
  Json json = Json::object();
  if (accuracy.model == tracer::Accuracy::Model::global) json["model"] = "global";
  if (const auto target = accuracy.target()) json["target_error"] = *target;
  if (const auto target = accuracy.tile_target()) json["tile_error"] = *target;
  if (!accuracy.adaptive) {
    json["samples"] = {accuracy.samples, accuracy.samples};
  } else {
    const tracer::Adaptive &adaptive = *accuracy.adaptive, usual_adaptive;
    if (adaptive.time_budget_ms) json["time_budget_ms"] = *adaptive.time_budget_ms;
    if (adaptive.samples_min != usual_adaptive.samples_min || adaptive.samples_max != usual_adaptive.samples_max)
      json["samples"] = {adaptive.samples_min, adaptive.samples_max};
  }
  if (accuracy.max_depth) json["max_depth"] = *accuracy.max_depth;
  if (accuracy.cutoff) json["cutoff"] = *accuracy.cutoff;
  if (accuracy.seed != 0) json["seed"] = accuracy.seed;
  if (accuracy.proof) json["proof"] = true;
  if (accuracy.approximate.any()) json["approximate"] = approximations_json(accuracy.approximate);
  return json;
}

Json error_json(const ErrorEstimate& error) {
  Json json = object_of({{"estimate", error.estimate},
                         {"proven", finite_or_null(error.proven)},
                         {"confidence", error.confidence},
                         {"target", or_null(error.target)},
                         {"met", error.target_met},
                         {"worst_tile", error.worst_tile},
                         {"tile_target", or_null(error.tile_target)},
                         {"bounded", error.bounded},
                         {"looks", error.looks},
                         {"limit", limit_json(error.limit)}});
  for (const auto& [name, part] : error_parts) json["parts"][name] = error.*part;
  return json;
}

ErrorEstimate error_of_json(const Json& json) {
  ErrorEstimate error;
  json.at("estimate").get_to(error.estimate);
  error.proven = number_or_none(json.at("proven")).value_or(std::numeric_limits<double>::infinity());
  json.at("confidence").get_to(error.confidence);
  error.target = number_or_none(json.at("target"));
  json.at("met").get_to(error.target_met);
  json.at("worst_tile").get_to(error.worst_tile);
  error.tile_target = number_or_none(json.at("tile_target"));
  json.at("bounded").get_to(error.bounded);
  json.at("looks").get_to(error.looks);
  error.limit = limit_of(json.at("limit"));
  for (const auto& [name, part] : error_parts) json.at("parts").at(name).get_to(error.*part);
  return error;
}

Json rays_json(const RayCounts& rays) {
  Json json;
  for (const auto& [name, count] : tracer::ray_kinds) json[name] = rays.*count;
  return json;
}

RayCounts rays_of_json(const Json& json) {
  RayCounts rays;
  for (const auto& [name, count] : tracer::ray_kinds) json.at(name).get_to(rays.*count);
  return rays;
}

}  // namespace api
