#include "tracer/src/measure/model_advice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <utility>

#include "tracer/src/measure/time_ranking.h"

namespace tracer {
namespace {

/// The point of the model with the samples of the baseline.
const MeasuredPoint* baseline(const Measurement& measurement, std::string_view model) {
  for (const MeasuredPoint& point : measurement.points)
    if (point.setting.model == model && !point.setting.accuracy.adaptive) return &point;
  return nullptr;
}

/// "[0.11, 0.035, 0.0071]".
std::string text_of_color(const Color& color) {
  return "[" + text_of_number(color.r) + ", " + text_of_number(color.g) + ", " + text_of_number(color.b) + "]";
}

/// "Whitted's image is 35 levels from the rendering equation and too dark; ambient [0.11, 0.035, 0.0071] would make it
/// 13; ...". Errors below that of the references are given as at most that.
std::string distances(const Measurement& measurement) {
  const ModelError& error = *measurement.model_error;
  if (error.levels <= error.standard_error)
    return "Whitted's image is that of the rendering equation, as far as references with an error of " +
           levels_text(error.standard_error) + " show";
  const double fitted = std::max(error.fitted_levels, error.standard_error);
  std::string sentence = "Whitted's image is " + levels_text(error.levels) + " from the rendering equation";
  if (std::abs(error.bias) > significant * error.levels)
    sentence += error.bias < 0 ? " and too dark" : " and too bright";
  if (error.fitted_levels < (1 - significant) * error.levels)
    sentence += "; ambient " + text_of_color(error.fitted_ambient) + " would make it " +
                (error.fitted_levels > error.standard_error ? "" : "at most ") + text_of_number(fitted);
  const MeasuredPoint* const whitted = baseline(measurement, "whitted");
  double least = std::min(error.levels, fitted);
  for (const std::string_view model : light_models) {
    const MeasuredPoint* const point = baseline(measurement, model);
    if (point == nullptr || whitted == nullptr || !point->setting.accuracy.approximate.any()) continue;
    const auto is_slower = [&](const MeasuredPoint& other) {
      return other.setting.model != model || saves_no_time(measurement.points, other);
    };
    if (std::ranges::all_of(measurement.points, is_slower)) continue;
    sentence += "; " + std::string(model) + (is_upper_limit(*point, "model_error") ? " at most " : " ") +
                text_of_number(*point->model_error);
    const double more = point->seconds - whitted->seconds;
    if (more > 0) sentence += " for " + text_of_number(more) + " s more";
    least = std::min(least, *point->model_error);
  }
  return sentence + "; below " + levels_text(least) + " only paths help";
}

/// "of the light that Whitted's model leaves out come 80 % from interreflection of lights, 20 % from glowing surfaces";
/// unset with one cause.
std::optional<std::string> causes(const LightByCause& by) {
  const auto sum = [](const Color& color) { return color.r + color.g + color.b; };
  const std::array parts{std::pair{"interreflection of lights", sum(by.interreflection)},
                         std::pair{"glowing surfaces", sum(by.emission)},
                         std::pair{"the background", sum(by.environment)}};
  double all = 0;
  for (const auto& [name, light] : parts) all += std::max(0.0, light);
  std::string sentence;
  int count = 0;
  for (const auto& [name, light] : parts) {
    if (!(light > significant * all)) continue;
    sentence += (count++ > 0 ? ", " : "") + text_of_number(100 * light / all) + " % from " + name;
  }
  if (count < 2) return std::nullopt;
  return "of the light that Whitted's model leaves out come " + sentence;
}

}  // namespace

std::string text_of_number(double number) {
  std::array<char, 32> buffer{};
  const double size = std::abs(number);
  const char* format = size >= 9.95 ? "%.0f" : size >= 0.995 ? "%.1f" : size >= 0.0995 ? "%.2f" : "%.2g";
  std::snprintf(buffer.data(), buffer.size(), format, number);
  return buffer.data();
}

double measurable_error(const Measurement& measurement) {
  return measurement.model_error ? measurement.model_error->standard_error : 0;
}

std::vector<std::size_t> model_front(const Measurement& measurement, std::string_view model) {
  const std::vector<MeasuredPoint>& points = measurement.points;
  std::vector<std::size_t> front;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].setting.model == model && points[i].total_error && !is_upper_limit(points[i], "total_error"))
      front.push_back(i);
  std::ranges::stable_sort(front, {}, [&](std::size_t index) { return points[index].seconds; });
  double least = std::numeric_limits<double>::infinity();
  std::erase_if(front, [&](std::size_t index) {
    if (*points[index].total_error >= least) return true;
    least = *points[index].total_error;
    return false;
  });
  return front;
}

std::vector<std::string> model_advice(const Measurement& measurement) {
  if (measurement.not_measured) return {"the rendering equation is not measured: " + *measurement.not_measured};
  if (!measurement.model_error) return {};
  std::vector<std::string> sentences{distances(measurement)};
  if (auto cause = causes(measurement.model_error->by)) sentences.push_back(*std::move(cause));
  return sentences;
}

std::vector<PlotSeries> model_series(const Measurement& measurement) {
  constexpr std::array marks{PlotMark::circle, PlotMark::square, PlotMark::diamond, PlotMark::triangle};
  const double least = measurable_error(measurement);
  std::pair times{std::numeric_limits<double>::infinity(), 0.0};  // of the first and the last point
  std::vector<PlotSeries> all;
  for (std::size_t m = 0; m < std::size(light_models); ++m) {
    PlotSeries series{.name = "total error: " + std::string(light_models[m]),
                      .points = {},
                      .mark = marks[m % marks.size()],
                      .join = PlotJoin::steps};
    PlotSeries limits{.name = "", .points = {}, .mark = series.mark, .color = 0x767676};
    for (const std::size_t index : model_front(measurement, light_models[m])) {
      const MeasuredPoint& point = measurement.points[index];
      series.points.push_back({point.seconds, *point.total_error, point.setting.value});
    }
    for (const MeasuredPoint& point : measurement.points)
      if (point.setting.model == light_models[m] && is_upper_limit(point, "total_error"))
        limits.points.push_back({point.seconds, *point.total_error, point.setting.value + " (at most)"});
    for (PlotSeries* drawn : {&series, &limits}) {
      for (const PlotPoint& point : drawn->points)
        times = {std::min(times.first, point.x), std::max(times.second, point.x)};
      if (!drawn->points.empty()) all.push_back(std::move(*drawn));
    }
  }
  if (!all.empty() && least > 0) {
    PlotSeries& line = all.emplace_back(PlotSeries{.name = "error of the references",
                                                   .points = {{times.first, least}, {times.second, least}},
                                                   .mark = PlotMark::none,
                                                   .join = PlotJoin::line});
    line.dashed = true;
    line.color = 0x767676;
  }
  return all;
}

}  // namespace tracer
