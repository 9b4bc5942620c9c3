#include "api/validation_json.h"

#include <algorithm>
#include <cmath>

#include "api/estimate.h"
#include "api/src/result_json.h"
#include "tracer/encode.h"

namespace api {
namespace {

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n'; }

Json errors_json(const std::vector<tracer::Issue>& errors) {
  Json list = Json::array();
  for (const tracer::Issue& issue : errors)
    list.push_back({{"pointer", uri_fragment(issue.pointer)}, {"code", issue.code}, {"detail", issue.detail}});
  return list;
}

/// Rounded to milliseconds.
Json seconds_json(const tracer::Scene& scene, std::optional<double> seconds_per_work) {
  std::optional<double> seconds;
  if (const auto work = estimated_work(scene); work && seconds_per_work) seconds = *work * *seconds_per_work;
  const tracer::Accuracy& accuracy = scene.accuracy;
  if (accuracy.adaptive && accuracy.adaptive->time_budget_ms) {
    const double budget = *accuracy.adaptive->time_budget_ms / 1000;
    seconds = std::min(seconds.value_or(budget), budget);
  }
  if (seconds) seconds = std::round(*seconds * 1000) / 1000;
  return or_null(seconds);
}

}  // namespace

std::string uri_fragment(const std::string& pointer) {
  constexpr std::string_view allowed =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~!$&'()*+,;=:@/?";
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string fragment = "#";
  for (const char c : pointer) {
    if (allowed.find(c) != std::string_view::npos) {
      fragment += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    fragment += {'%', digits[byte >> 4], digits[byte & 15]};
  }
  return fragment;
}

std::string write_valid(const tracer::Scene& scene, std::optional<double> seconds_per_work) {
  const tracer::Accuracy& accuracy = scene.accuracy;
  const std::uint64_t samples = accuracy.adaptive ? accuracy.adaptive->samples_min : accuracy.samples;
  Json json = {{"valid", true}, {"errors", Json::array()}};
  json.update(requirements_json(scene));
  json["estimate"] = {{"samples", scene.image.window().pixels() * samples},
                      {"seconds", seconds_json(scene, seconds_per_work)},
                      {"memory_bytes", estimated_memory_bytes(scene)}};
  return text_of(json);
}

std::string write_invalid(const std::vector<tracer::Issue>& errors) {
  return text_of({{"valid", false},
                  {"errors", errors_json(errors)},
                  {"requirements", nullptr},
                  {"reasons", nullptr},
                  {"estimate", nullptr}});
}

std::string with_format(const std::string& document, tracer::Format format) {
  Json json = Json::parse(document);
  Json& formats = json["output"]["formats"];
  // Without the field the default formats apply; they are kept.
  if (formats.is_null())
    for (const tracer::Format usual : tracer::Output{}.formats) formats.push_back(tracer::name(usual));
  formats.push_back(tracer::name(format));
  return json.dump();
}

}  // namespace api
