// Conclusions from a measurement: the Pareto front, sentences, and a chart.
#include <algorithm>
#include <array>
#include <iterator>
#include <optional>

#include "tracer/measurement.h"
#include "tracer/src/measure/model_advice.h"
#include "tracer/src/measure/time_ranking.h"
#include "tracer/validate.h"

namespace tracer {
namespace {

struct Goal {
  double error;  ///< levels
  const char* text;
};
/// Errors acceptable for layout, for presentation, and for archiving.
constexpr std::array goals{Goal{4, "4 levels"}, Goal{1, "1 level"}, Goal{0.5, "0.5 levels"}};

/// Three digits, for errors that differ little.
std::string close_levels(double error) { return text_of(error, 3) + " levels"; }

std::string seconds(double time) { return text_of_number(time) + " s"; }

/// "true error 3.1 levels", "true error at most 3.1 levels".
std::string true_error(const MeasuredPoint& point) {
  return std::string("true error ") + (is_upper_limit(point, "error") ? "at most " : "") + levels_text(point.error);
}

const MeasuredPoint* find(const Measurement& measurement, std::string_view parameter, std::string_view value) {
  for (const MeasuredPoint& point : measurement.points)
    if (point.setting.parameter == parameter && point.setting.value == value) return &point;
  return nullptr;
}

/// "for 4 levels: target_error 4 (draft), 0.12 s, true error 3.1 levels; for 1 level: ..."; ends with the best point at
/// the first goal that no point claims.
std::string cheapest(const Measurement& measurement) {
  const std::vector<std::size_t> front = pareto_front(measurement);
  if (front.empty()) return "for " + std::string(goals.front().text) + ": no setting, all claims are broken";
  std::string sentence;
  for (const Goal& goal : goals) {
    const auto within = std::ranges::find_if(
        front, [&](std::size_t i) { return measurement.points[i].claimed.estimate <= goal.error; });
    const bool reached = within != front.end();
    const MeasuredPoint& point = measurement.points[reached ? *within : front.back()];
    sentence += (sentence.empty() ? "for " : "; for ") + std::string(goal.text) + ": ";
    if (!reached) sentence += "no setting, the best is ";
    sentence += title(point.setting) + ", " + seconds(point.seconds);
    if (!reached) return sentence + ", claimed error " + levels_text(point.claimed.estimate);
    sentence += ", " + true_error(point);
  }
  return sentence;
}

/// Value beyond which a parameter, whose values are ordered from coarse to fine, has no significant effect. Unset if
/// one of the errors is an upper limit.
std::optional<std::string> saturation(const Measurement& measurement, std::string_view parameter, const char* beyond) {
  std::vector<const MeasuredPoint*> series;
  for (const MeasuredPoint& point : measurement.points)
    if (point.setting.parameter == parameter) series.push_back(&point);
  const auto is_limit = [](const MeasuredPoint* point) { return is_upper_limit(*point, "error"); };
  if (series.size() < 2 || std::ranges::any_of(series, is_limit)) return std::nullopt;
  const MeasuredPoint& last = *series.back();
  std::size_t enough = series.size() - 1;
  while (enough > 0 && series[enough - 1]->error <= (1 + significant) * last.error) --enough;
  const std::string name(parameter);
  if (enough + 1 == series.size()) {
    const MeasuredPoint& before = *series[series.size() - 2];
    return name + " " + last.setting.value + " still reduces the error: " + levels_text(last.error) + " instead of " +
           text_of_number(before.error) + " with " + before.setting.value;
  }
  return name + " " + beyond + " " + series[enough]->setting.value + " does not reduce the error";
}

/// "shadows: map saves 30 % and costs 3.1 levels"; without a percentage of times whose order is uncertain, and without
/// a difference of errors of which one is an upper limit.
std::string exchange(const MeasuredPoint& point, const MeasuredPoint& baseline) {
  const double saved = 1 - point.seconds / baseline.seconds;
  const double cost = point.error - baseline.error;
  std::string sentence = point.setting.value;
  if (compare_times(point.runs, baseline.runs) == TimeOrder::uncertain) {
    sentence += " saves no certain time";
  } else if (saved >= significant) {
    sentence += " saves " + text_of_number(100 * saved) + " %";
  } else {
    sentence += saved > -significant ? " saves no time" : " takes " + text_of_number(-100 * saved) + " % longer";
  }
  if (is_upper_limit(point, "error") || is_upper_limit(baseline, "error"))
    return sentence + " and has a " + true_error(point);
  if (cost <= significant * baseline.error) return sentence + " and does not increase the error";
  return sentence + " and costs " + levels_text(cost);
}

std::string claims(const Measurement& measurement) {
  std::vector<const MeasuredPoint*> broken;
  std::size_t unknown = 0;
  for (const MeasuredPoint& point : measurement.points) {
    if (is_broken(measurement, point)) broken.push_back(&point);
    if (is_upper_limit(point, "error")) ++unknown;
  }
  const std::string count = std::to_string(measurement.points.size() - unknown);
  const std::string rest = unknown == 0 ? "" : "; the other errors are below that of the reference and unknown";
  if (unknown == measurement.points.size()) return "all true errors are below that of the reference and unknown";
  if (broken.empty()) return "the true error was within the claimed one in all " + count + " settings" + rest;
  const auto worse = [](const MeasuredPoint* one, const MeasuredPoint* other) {
    return one->error * other->claimed.estimate < other->error * one->claimed.estimate;
  };
  const MeasuredPoint& worst = **std::ranges::max_element(broken, worse);
  return "the true error was above the claimed one in " + std::to_string(broken.size()) + " of " + count +
         " settings, by the largest factor with " + title(worst.setting) + ": " + close_levels(worst.error) +
         ", claimed " + close_levels(worst.claimed.estimate) + rest;
}

/// "the order in time is uncertain of samples 16, cutoff 0.001 and 2 other settings"; unset if all are ranked.
std::optional<std::string> uncertain_times(const Measurement& measurement) {
  constexpr std::size_t named_max = 3;
  const std::vector<std::size_t> unranked = unranked_points(measurement.points);
  if (unranked.empty()) return std::nullopt;
  const std::size_t named = unranked.size() <= named_max ? unranked.size() : named_max - 1;
  std::string sentence = "the order in time is uncertain of";
  for (std::size_t i = 0; i < named; ++i)
    sentence += (i == 0 ? " " : ", ") + title(measurement.points[unranked[i]].setting);
  if (named == unranked.size()) return sentence;
  return sentence + " and " + std::to_string(unranked.size() - named) + " other settings";
}

/// "model" has series of its own.
constexpr std::array marks{PlotMark::circle, PlotMark::square, PlotMark::diamond, PlotMark::triangle,
                           PlotMark::square, PlotMark::none,   PlotMark::diamond};
static_assert(marks.size() == std::size(parameters));
constexpr std::uint32_t grey = 0x767676;

/// ASCII letters only: parameters and advice have no others.
std::string capitalized(std::string sentence) {
  char& first = sentence.front();
  if (first >= 'a' && first <= 'z') first = static_cast<char>(first - 'a' + 'A');
  return sentence;
}

std::string reference_text(const Measurement& measurement) {
  return "reference: " + std::to_string(measurement.reference_samples) + " samples, standard error " +
         text_of(measurement.reference_error, 2) + " levels";
}

constexpr std::uint32_t red = 0xc00000;

/// Pairs of claimed and true error, of kept or of broken claims.
PlotSeries claim_series(const Measurement& measurement, bool broken) {
  PlotSeries series{.name = broken ? "broken claim" : "claimed",
                    .points = {},
                    .mark = PlotMark::cross,
                    .join = PlotJoin::pairs,
                    .color = broken ? red : grey};
  for (const MeasuredPoint& point : measurement.points) {
    if (!point.setting.model.empty() || is_broken(measurement, point) != broken) continue;
    series.points.push_back({point.seconds, point.claimed.estimate});
    series.points.push_back({point.seconds, point.error});
  }
  return series;
}

PlotSeries front_series(const Measurement& measurement) {
  PlotSeries series{
      .name = "Pareto front", .points = {}, .mark = PlotMark::none, .join = PlotJoin::steps, .color = grey};
  series.dashed = true;
  for (const std::size_t index : pareto_front(measurement))
    series.points.push_back({measurement.points[index].seconds, measurement.points[index].claimed.estimate});
  return series;
}

}  // namespace

bool is_upper_limit(const MeasuredPoint& point, std::string_view error) {
  return std::ranges::find(point.upper_limits, error) != point.upper_limits.end();
}

bool is_broken(const Measurement& measurement, const MeasuredPoint& point) {
  const bool has_both = !point.setting.model.empty() && measurement.model_error;
  const double slack = has_both ? measurement.model_error->standard_error : measurement.reference_error;
  return point.error - slack > point.claimed.estimate;
}

std::vector<std::size_t> pareto_front(const Measurement& measurement) {
  const std::vector<MeasuredPoint>& points = measurement.points;
  const auto claim = [&](std::size_t index) { return points[index].claimed.estimate; };
  std::vector<std::size_t> by_claim;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].setting.model.empty() && !is_broken(measurement, points[i]) && !saves_no_time(points, points[i]))
      by_claim.push_back(i);
  std::ranges::stable_sort(by_claim, {}, claim);
  std::vector<std::size_t> front;  // slowest first
  for (const std::size_t index : by_claim) {
    if (front.empty()) {
      front.push_back(index);
      continue;
    }
    const MeasuredPoint &fastest = points[front.back()], &point = points[index];
    const bool equal_claims = claim(index) == claim(front.back());
    const TimeOrder order = compare_times(point.runs, fastest.runs);
    if (point.seconds >= fastest.seconds || order == TimeOrder::equal) continue;
    if (equal_claims && order == TimeOrder::uncertain) continue;
    if (equal_claims) front.pop_back();
    front.push_back(index);
  }
  std::ranges::reverse(front);
  return front;
}

std::vector<std::string> advice(const Measurement& measurement) {
  if (measurement.points.empty()) return {};
  std::vector<std::string> sentences = model_advice(measurement);
  const auto has_claim = [](const MeasuredPoint& point) { return point.setting.model.empty(); };
  if (std::ranges::any_of(measurement.points, has_claim)) sentences.push_back(cheapest(measurement));
  sentences.push_back(claims(measurement));
  if (auto order = uncertain_times(measurement)) sentences.push_back(*std::move(order));
  if (auto depth = saturation(measurement, "max_depth", "beyond")) sentences.push_back(*std::move(depth));
  if (auto cutoff = saturation(measurement, "cutoff", "below")) sentences.push_back(*std::move(cutoff));
  if (const MeasuredPoint* baseline = find(measurement, "samples", std::to_string(baseline_samples)))
    for (const MeasuredPoint& point : measurement.points)
      if (point.setting.parameter == "approximate") sentences.push_back(exchange(point, *baseline));
  return sentences;
}

Plot chart(const Measurement& measurement) {
  Plot plot{.title = measurement.name.empty() ? "Accuracy and time" : "Accuracy and time: " + measurement.name};
  plot.x = {"time to build and trace (s)", true};
  plot.y = {"error (levels, root mean square)", true};
  for (PlotSeries series :
       {front_series(measurement), claim_series(measurement, false), claim_series(measurement, true)})
    if (!series.points.empty()) plot.series.push_back(std::move(series));
  for (std::size_t i = 0; i < std::size(parameters); ++i) {
    PlotSeries series{.name = std::string(parameters[i]), .points = {}, .mark = marks[i]};
    for (const MeasuredPoint& point : measurement.points)
      if (point.setting.parameter == parameters[i] && point.setting.model.empty())
        series.points.push_back({point.seconds, point.error,
                                 (point.setting.preset.empty() ? point.setting.value : title(point.setting)) +
                                     (is_upper_limit(point, "error") ? " (at most)" : "")});
    if (!series.points.empty()) plot.series.push_back(std::move(series));
  }
  std::ranges::move(model_series(measurement), std::back_inserter(plot.series));
  plot.note = std::to_string(measurement.width) + " x " + std::to_string(measurement.height) + " pixels; " +
              reference_text(measurement) + ".";
  for (const std::string& sentence : advice(measurement)) plot.note += " " + capitalized(sentence) + ".";
  plot.width = 1200;
  plot.height = 760;
  return plot;
}

}  // namespace tracer
