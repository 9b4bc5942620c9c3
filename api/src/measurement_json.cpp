#include "api/measurement_json.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iterator>
#include <locale>
#include <sstream>
#include <utility>

#include "api/src/result_json.h"
#include "tracer/version.h"

namespace api {
namespace {

constexpr std::string_view kind = "whittle measurement";
constexpr int form_version = 2;

/// The members that both forms of a point have.
Json measured_json(const tracer::Measurement& measurement, const tracer::MeasuredPoint& point) {
  const tracer::Setting& setting = point.setting;
  return object_of({{"parameter", setting.parameter},
                    {"value", setting.value},
                    {"preset", setting.preset.empty() ? Json(nullptr) : Json(setting.preset)},
                    {"settings", accuracy_json(setting.accuracy)},
                    {"seconds", point.seconds},
                    {"error", point.error},
                    {"upper_limits", point.upper_limits},
                    {"broken", tracer::is_broken(measurement, point)},
                    {"model", setting.model.empty() ? Json(nullptr) : Json(setting.model)},
                    {"model_error", or_null(point.model_error)},
                    {"total_error", or_null(point.total_error)}});
}

Json color_json(const tracer::Color& color) { return Json::array({color.r, color.g, color.b}); }

/// Null without the parameter "model".
Json model_error_json(const tracer::Measurement& measurement) {
  if (measurement.not_measured) return object_of({{"not_measured", *measurement.not_measured}});
  if (!measurement.model_error) return nullptr;
  const tracer::ModelError& error = *measurement.model_error;
  Json fronts = Json::object(), upper_limits = Json::array();
  for (const auto& [name, levels] : {std::pair{"levels", error.levels}, {"fitted_levels", error.fitted_levels}})
    if (error.standard_error > 0 && levels <= error.standard_error) upper_limits.push_back(name);
  for (const std::string_view model : tracer::light_models)
    fronts[std::string(model)] = tracer::model_front(measurement, model);
  return object_of({{"levels", std::max(error.levels, error.standard_error)},
                    {"standard_error", error.standard_error},
                    {"bias", error.bias},
                    {"by", object_of({{"interreflection", color_json(error.by.interreflection)},
                                      {"emission", color_json(error.by.emission)},
                                      {"environment", color_json(error.by.environment)},
                                      {"ambient", color_json(error.by.ambient)}})},
                    {"fitted_ambient", color_json(error.fitted_ambient)},
                    {"fitted_levels", std::max(error.fitted_levels, error.standard_error)},
                    {"upper_limits", std::move(upper_limits)},
                    {"fronts", std::move(fronts)}});
}

Json point_json(const tracer::Measurement& measurement, const tracer::MeasuredPoint& point) {
  Json json = measured_json(measurement, point);
  json["runs"] = point.runs;
  json["claimed"] = error_json(point.claimed);
  json["samples"] = object_of({{"mean", point.samples_mean}, {"total", point.samples}});
  json["rays"] = rays_json(point.rays);
  return json;
}

Json summary_json(const tracer::Measurement& measurement, const tracer::MeasuredPoint& point) {
  Json json = measured_json(measurement, point);
  json["claimed"] = point.claimed.estimate;
  return json;
}

/// Appends reference, points, pareto_front and advice; `write_point` gives a point's members.
void append_results(const tracer::Measurement& measurement,
                    Json (*write_point)(const tracer::Measurement&, const tracer::MeasuredPoint&), Json& json) {
  json["reference"] = object_of({{"samples", measurement.reference_samples}, {"error", measurement.reference_error}});
  Json& points = json["points"] = Json::array();
  for (const tracer::MeasuredPoint& point : measurement.points) points.push_back(write_point(measurement, point));
  json["pareto_front"] = tracer::pareto_front(measurement);
  json["model_error"] = model_error_json(measurement);
  json["advice"] = tracer::advice(measurement);
}

tracer::MeasuredPoint point_of(const Json& json) {
  tracer::MeasuredPoint point;
  json.at("parameter").get_to(point.setting.parameter);
  json.at("value").get_to(point.setting.value);
  json.at("seconds").get_to(point.seconds);
  point.runs = json.value("runs", std::vector<double>());
  if (point.runs.empty()) point.runs = {point.seconds};  // earlier versions wrote no runs
  json.at("error").get_to(point.error);
  point.upper_limits = json.value("upper_limits", point.upper_limits);
  point.claimed = error_of_json(json.at("claimed"));
  json.at("samples").at("mean").get_to(point.samples_mean);
  json.at("samples").at("total").get_to(point.samples);
  point.rays = rays_of_json(json.at("rays"));
  for (const auto& [name, member] : {std::pair{"model_error", &tracer::MeasuredPoint::model_error},
                                     std::pair{"total_error", &tracer::MeasuredPoint::total_error}})
    if (const auto found = json.find(name); found != json.end() && found->is_number())
      point.*member = found->get<double>();
  return point;
}

std::string csv_line(const tracer::Measurement& measurement, const tracer::MeasuredPoint& point, bool in_front) {
  const tracer::ErrorEstimate& claimed = point.claimed;
  std::ostringstream line;
  line.imbue(std::locale::classic());
  line << std::setprecision(9) << point.setting.parameter << ',' << point.setting.value << ',' << point.setting.preset;
  for (const double value : {point.seconds, point.error, claimed.estimate}) line << ',' << value;
  line << ',';
  if (std::isfinite(claimed.proven)) line << claimed.proven;
  line << ',' << claimed.confidence << ',' << claimed.target_met;
  for (const double value : {claimed.worst_tile, claimed.sampling, claimed.depth, claimed.cutoff, claimed.approximation,
                             claimed.tone, point.samples_mean})
    line << ',' << value;
  for (const auto& [name, count] : tracer::ray_kinds) line << ',' << point.rays.*count;
  line << ',' << in_front << ',' << measurement.reference_error << ',' << tracer::is_broken(measurement, point) << ','
       << point.runs.size() << ',' << point.setting.model;
  for (const std::optional<double>& error : {point.model_error, point.total_error}) {
    line << ',';
    if (error) line << *error;
  }
  for (const char* separator = ","; const std::string& name : point.upper_limits)
    line << std::exchange(separator, " ") << name;
  if (point.upper_limits.empty()) line << ',';
  line << '\n';
  return line.str();
}

Json worst_json(const std::vector<tracer::PixelDifference>& worst) {
  return array_of(worst, [](const tracer::PixelDifference& pixel) {
    return object_of(
        {{"x", pixel.x}, {"y", pixel.y}, {"difference", pixel.difference}, {"a", pixel.a}, {"b", pixel.b}});
  });
}

}  // namespace

std::string write_measurement(const tracer::Measurement& measurement, const MeasurementInfo& info) {
  Json json = object_of({{"kind", kind},
                         {"version", form_version},
                         {"build", tracer::build()},
                         {"key", info.key},
                         {"complete", info.complete},
                         {"scene", measurement.name},
                         {"width", measurement.width},
                         {"height", measurement.height}});
  append_results(measurement, point_json, json);
  return json.dump(1) + '\n';
}

std::string write_measurement_summary(const tracer::Measurement& measurement, bool alone) {
  Json json = object_of({{"width", measurement.width}, {"height", measurement.height}, {"alone", alone}});
  append_results(measurement, summary_json, json);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string write_measurement_csv(const tracer::Measurement& measurement) {
  std::vector<std::size_t> front = tracer::pareto_front(measurement);
  for (const std::string_view model : tracer::light_models)
    std::ranges::copy(tracer::model_front(measurement, model), std::back_inserter(front));
  std::string text =
      "parameter,value,preset,seconds,error,claimed,proven,confidence,met,worst_tile,sampling,depth,cutoff,"
      "approximation,tone,samples_mean,camera,shadow,reflection,refraction,diffuse,pareto_front,reference_error,broken,"
      "runs,model,model_error,total_error,upper_limits\n";
  for (std::size_t i = 0; i < measurement.points.size(); ++i) {
    const bool in_front = std::ranges::find(front, i) != front.end();
    text += csv_line(measurement, measurement.points[i], in_front);
  }
  return text;
}

std::optional<SavedMeasurement> read_measurement(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  try {
    if (json.at("kind") != kind || json.at("version") != form_version) return std::nullopt;
    SavedMeasurement saved;
    json.at("key").get_to(saved.info.key);
    json.at("complete").get_to(saved.info.complete);
    for (const Json& point : json.at("points")) saved.points.push_back(point_of(point));
    return saved;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

std::string write_comparison(const tracer::Comparison& comparison, const ComparisonInfo& info) {
  const std::optional<double>& tolerance = info.tolerance;
  const Json json = object_of({{"formats", info.formats},
                               {"width", comparison.width},
                               {"height", comparison.height},
                               {"rmse", comparison.rmse},
                               {"rmse_channel", comparison.rmse_channel},
                               {"bias", comparison.bias},
                               {"greatest", comparison.greatest},
                               {"psnr_db", comparison.psnr_db},
                               {"ssim", or_null(comparison.ssim)},
                               {"differing", comparison.differing},
                               {"worst", worst_json(comparison.worst)},
                               {"tolerance", or_null(tolerance)},
                               {"within_tolerance", tolerance ? Json(comparison.rmse <= *tolerance) : Json(nullptr)},
                               {"heat_white", or_null(info.heat_white)}});
  return json.dump() + '\n';
}

std::optional<std::string> add_heat_map(std::string_view comparison, const std::optional<std::string>& url) {
  Json json = Json::parse(comparison, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  json["heat_map"] = url ? Json(*url) : Json(nullptr);
  return json.dump() + '\n';
}

}  // namespace api
