#include "api/measurement_json.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "api/src/accuracy_json.h"
#include "api/src/error_json.h"
#include "tracer/version.h"

namespace api {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kind = "whittle measurement";
constexpr int version = 1;

Json setting_json(const tracer::Setting& setting) {
  return {{"parameter", setting.parameter},
          {"value", setting.value},
          {"preset", setting.preset.empty() ? Json(nullptr) : Json(setting.preset)},
          {"settings", accuracy_json(setting.accuracy)}};
}

Json point_json(const tracer::MeasuredPoint& point) {
  Json json = setting_json(point.setting);
  json["seconds"] = point.seconds;
  json["error"] = point.error;
  json["claimed"] = error_json(point.claimed);
  json["samples"] = {{"mean", point.samples_mean}, {"total", point.samples}};
  json["rays"] = rays_json(point.rays);
  return json;
}

Json reference_json(const tracer::Measurement& measurement) {
  return {{"samples", measurement.reference_samples}, {"error", measurement.reference_error}};
}

tracer::MeasuredPoint point_of(const Json& json) {
  tracer::MeasuredPoint point;
  json.at("parameter").get_to(point.setting.parameter);
  json.at("value").get_to(point.setting.value);
  json.at("seconds").get_to(point.seconds);
  json.at("error").get_to(point.error);
  point.claimed = error_of_json(json.at("claimed"));
  json.at("samples").at("mean").get_to(point.samples_mean);
  json.at("samples").at("total").get_to(point.samples);
  point.rays = rays_of_json(json.at("rays"));
  return point;
}

std::string csv_line(const tracer::MeasuredPoint& point, bool in_front, double reference_error) {
  const auto number = [](double value) {
    std::array<char, 32> buffer{};
    std::snprintf(buffer.data(), buffer.size(), "%.9g", value);
    return std::string(buffer.data());
  };
  const tracer::ErrorEstimate& claimed = point.claimed;
  std::string line = point.setting.parameter + "," + point.setting.value + "," + point.setting.preset;
  for (const double value : {point.seconds, point.error, claimed.estimate, claimed.confidence})
    line += "," + number(value);
  line += claimed.target_met ? ",1" : ",0";
  for (const double value :
       {claimed.sampling, claimed.depth, claimed.cutoff, claimed.approximation, point.samples_mean})
    line += "," + number(value);
  for (const std::uint64_t count : {point.rays.camera, point.rays.shadow, point.rays.reflection, point.rays.refraction})
    line += "," + std::to_string(count);
  return line + (in_front ? ",1," : ",0,") + number(reference_error) + "\n";
}

}  // namespace

std::string write_measurement(const tracer::Measurement& measurement, const MeasuredAs& how) {
  Json points = Json::array();
  for (const tracer::MeasuredPoint& point : measurement.points) points.push_back(point_json(point));
  const Json json{{"kind", kind},
                  {"version", version},
                  {"build", tracer::build()},
                  {"key", how.key},
                  {"complete", how.complete},
                  {"scene", measurement.name},
                  {"width", measurement.width},
                  {"height", measurement.height},
                  {"reference", reference_json(measurement)},
                  {"points", points},
                  {"pareto_front", tracer::pareto_front(measurement.points)},
                  {"advice", tracer::advice(measurement)}};
  return json.dump(1) + '\n';
}

std::string write_measurement_summary(const tracer::Measurement& measurement, bool alone) {
  Json points = Json::array();
  for (const tracer::MeasuredPoint& point : measurement.points) {
    Json json = setting_json(point.setting);
    json["seconds"] = point.seconds;
    json["error"] = point.error;
    json["claimed"] = point.claimed.estimate;
    points.push_back(std::move(json));
  }
  const Json json{{"width", measurement.width},
                  {"height", measurement.height},
                  {"alone", alone},
                  {"reference", reference_json(measurement)},
                  {"points", points},
                  {"pareto_front", tracer::pareto_front(measurement.points)},
                  {"advice", tracer::advice(measurement)}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string write_measurement_csv(const tracer::Measurement& measurement) {
  const std::vector<std::size_t> front = tracer::pareto_front(measurement.points);
  std::string text =
      "parameter,value,preset,seconds,error,claimed,confidence,met,sampling,depth,cutoff,approximation,samples_mean,"
      "camera,"
      "shadow,reflection,refraction,pareto_front,reference_error\n";
  for (std::size_t i = 0; i < measurement.points.size(); ++i) {
    const bool in_front = std::find(front.begin(), front.end(), i) != front.end();
    text += csv_line(measurement.points[i], in_front, measurement.reference_error);
  }
  return text;
}

std::optional<SavedMeasurement> read_measurement(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  try {
    if (json.at("kind") != kind || json.at("version") != version) return std::nullopt;
    SavedMeasurement saved;
    json.at("key").get_to(saved.how.key);
    json.at("complete").get_to(saved.how.complete);
    for (const Json& point : json.at("points")) saved.points.push_back(point_of(point));
    return saved;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

}  // namespace api
