// From numbers to sentences.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "tracer/measurement.h"

namespace tracer {
namespace {

struct Wish {
  double error;  ///< levels
  const char* text;
};
/// To look whether all is in its place, to show, to keep.
constexpr std::array wishes{Wish{4, "4 levels"}, Wish{1, "1 level"}, Wish{0.5, "0.5 levels"}};
constexpr double matters = 0.05;  // of an error or a time: below it, single runs differ by chance

/// Two digits: single runs are no better known.
std::string text(double number) {
  std::array<char, 32> buffer{};
  const double size = std::abs(number);
  const char* format = size >= 9.95 ? "%.0f" : size >= 0.995 ? "%.1f" : size >= 0.0995 ? "%.2f" : "%.2g";
  std::snprintf(buffer.data(), buffer.size(), format, number);
  return buffer.data();
}

std::string levels(double error) { return text(error) + " levels"; }

std::string seconds(double time) { return text(time) + " s"; }

const MeasuredPoint* find(const Measurement& measurement, std::string_view parameter, std::string_view value) {
  for (const MeasuredPoint& point : measurement.points)
    if (point.setting.parameter == parameter && point.setting.value == value) return &point;
  return nullptr;
}

/// "for 4 levels: target_error 4 (draft), 0.12 s; for 1 level: ..." and, of wishes that nothing meets, the best there
/// is.
std::string cheapest(const Measurement& measurement) {
  const std::vector<std::size_t> front = pareto_front(measurement.points);
  std::string sentence;
  for (const Wish& wish : wishes) {
    const auto within = std::find_if(front.begin(), front.end(),
                                     [&](std::size_t i) { return measurement.points[i].error <= wish.error; });
    const bool met = within != front.end();
    const MeasuredPoint& point = measurement.points[met ? *within : front.back()];
    sentence += (sentence.empty() ? "for " : "; for ") + std::string(wish.text) + ": ";
    if (!met) sentence += "nothing here, the best is ";
    sentence += title(point.setting) + ", " + seconds(point.seconds);
    if (met) continue;
    return sentence + " and " + levels(point.error);
  }
  return sentence;
}

/// Where turning a parameter of `measurement`, whose values get finer and finer, stops to matter.
std::optional<std::string> saturation(const Measurement& measurement, std::string_view parameter, const char* beyond) {
  std::vector<const MeasuredPoint*> series;
  for (const MeasuredPoint& point : measurement.points)
    if (point.setting.parameter == parameter) series.push_back(&point);
  if (series.size() < 2) return std::nullopt;
  const MeasuredPoint& last = *series.back();
  std::size_t enough = series.size() - 1;
  while (enough > 0 && series[enough - 1]->error <= (1 + matters) * last.error) --enough;
  const std::string name(parameter);
  if (enough + 1 == series.size()) {
    const MeasuredPoint& before = *series[series.size() - 2];
    return name + " " + last.setting.value + " still gains: " + levels(last.error) + " instead of " +
           text(before.error) + " with " + before.setting.value;
  }
  return name + " " + beyond + " " + series[enough]->setting.value + " buys nothing here";
}

/// "shadows: map saves 30 % and costs 3.1 levels".
std::string exchange(const MeasuredPoint& point, const MeasuredPoint& baseline) {
  const double saved = 1 - point.seconds / baseline.seconds;
  const double cost = point.error - baseline.error;
  std::string sentence = point.setting.value;
  if (saved >= matters) {
    sentence += " saves " + text(100 * saved) + " %";
  } else {
    sentence += saved > -matters ? " saves no time" : " takes " + text(-100 * saved) + " % longer";
  }
  if (cost <= matters * baseline.error) return sentence + " and costs no accuracy that shows";
  return sentence + " and costs " + levels(cost);
}

/// Claims are made at their confidence: a few may fail. Errors below the reference's own are none that it can judge.
std::string claims(const Measurement& measurement) {
  std::vector<const MeasuredPoint*> broken;
  for (const MeasuredPoint& point : measurement.points)
    if (point.error - measurement.reference_error > point.claimed.estimate) broken.push_back(&point);
  const std::string count = std::to_string(measurement.points.size());
  if (broken.empty()) return "the true error was within the claimed one in all " + count + " settings";
  const auto worse = [](const MeasuredPoint* one, const MeasuredPoint* other) {
    return one->error * other->claimed.estimate < other->error * one->claimed.estimate;
  };
  const MeasuredPoint& worst = **std::max_element(broken.begin(), broken.end(), worse);
  return "the true error was above the claimed one in " + std::to_string(broken.size()) + " of " + count +
         " settings, farthest with " + title(worst.setting) + ": " + levels(worst.error) + ", claimed " +
         text(worst.claimed.estimate);
}

}  // namespace

std::vector<std::string> advice(const Measurement& measurement) {
  if (measurement.points.empty()) return {};
  std::vector<std::string> sentences{cheapest(measurement), claims(measurement)};
  if (auto depth = saturation(measurement, "max_depth", "beyond")) sentences.push_back(*std::move(depth));
  if (auto cutoff = saturation(measurement, "cutoff", "below")) sentences.push_back(*std::move(cutoff));
  if (const MeasuredPoint* baseline = find(measurement, "samples", std::to_string(baseline_samples)))
    for (const MeasuredPoint& point : measurement.points)
      if (point.setting.parameter == "approximate") sentences.push_back(exchange(point, *baseline));
  return sentences;
}

}  // namespace tracer
