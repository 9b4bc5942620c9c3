#include <array>
#include <cstdio>

#include "tracer/measurement.h"

namespace tracer {
namespace {

constexpr std::array marks{PlotMark::circle,   PlotMark::square, PlotMark::diamond,
                           PlotMark::triangle, PlotMark::square, PlotMark::diamond};
static_assert(marks.size() == std::size(parameters));
constexpr std::uint32_t grey = 0x767676;

std::string reference_text(const Measurement& measurement) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "reference: %u samples, standard error %.2g levels",
                measurement.reference_samples, measurement.reference_error);
  return text.data();
}

/// Pairs of claimed and true error.
PlotSeries claims(const Measurement& measurement) {
  PlotSeries series{.name = "claimed", .points = {}, .mark = PlotMark::cross, .join = PlotJoin::pairs, .color = grey};
  for (const MeasuredPoint& point : measurement.points) {
    series.points.push_back({point.seconds, point.claimed.estimate});
    series.points.push_back({point.seconds, point.error});
  }
  return series;
}

PlotSeries front(const Measurement& measurement) {
  PlotSeries series{
      .name = "Pareto front", .points = {}, .mark = PlotMark::none, .join = PlotJoin::steps, .color = grey};
  series.dashed = true;
  for (const std::size_t index : pareto_front(measurement.points))
    series.points.push_back({measurement.points[index].seconds, measurement.points[index].error});
  return series;
}

}  // namespace

Plot chart(const Measurement& measurement) {
  Plot plot{.title = measurement.name.empty() ? "Accuracy and time" : "Accuracy and time: " + measurement.name};
  plot.x = {"time to build and trace (s)", true};
  plot.y = {"error (levels, root mean square)", true};
  plot.series = {front(measurement), claims(measurement)};
  for (std::size_t i = 0; i < std::size(parameters); ++i) {
    PlotSeries series{.name = std::string(parameters[i]), .points = {}, .mark = marks[i]};
    for (const MeasuredPoint& point : measurement.points)
      if (point.setting.parameter == parameters[i])
        series.points.push_back(
            {point.seconds, point.error, point.setting.preset.empty() ? point.setting.value : title(point.setting)});
    if (!series.points.empty()) plot.series.push_back(std::move(series));
  }
  plot.note = std::to_string(measurement.width) + " x " + std::to_string(measurement.height) + " pixels; " +
              reference_text(measurement) + ".";
  for (const std::string& sentence : advice(measurement)) plot.note += " " + sentence + ".";
  plot.width = 1200;
  plot.height = 760;
  return plot;
}

}  // namespace tracer
