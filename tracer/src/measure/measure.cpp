// Measures the settings one after another.
#include "tracer/measure.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <new>
#include <numeric>
#include <utility>

#include "tracer/compare.h"
#include "tracer/src/measure/time_ranking.h"

namespace tracer {
namespace {

constexpr std::uint32_t images_min = 4;   // for a usable variance
constexpr double reference_share = 0.1;   // maximum standard error, relative to the error of the finest setting
constexpr double run_seconds_min = 0.02;  // caches and interrupts dominate shorter renders
constexpr int renders_max = 100;          // of one run
constexpr double repeat_share_max = 2;    // time of the repeated runs, relative to the first ones
constexpr double repeat_seconds_min = 10;
const Failure no_memory{Failure::Code::out_of_memory, "no memory for the images to compare"};

/// Reference and image are independent, so the mean of the squared difference is the sum of both squared errors; the
/// reference's part is subtracted. Precondition: equal sizes.
double error_of(const DisplayImage& reference, double reference_error, const DisplayImage& image) {
  const auto comparison = compare(reference, image, 0);
  assert(comparison.has_value());
  const double difference = comparison->rmse;
  return std::sqrt(std::max(0.0, (difference - reference_error) * (difference + reference_error)));
}

void add_run(MeasuredPoint& point, double seconds) {
  point.runs.push_back(seconds);
  point.seconds = std::ranges::min(point.runs);
}

/// The setting with the smallest expected error.
const Setting& finest(const std::vector<Setting>& settings) {
  const auto coarser = [](const Setting& one, const Setting& other) {
    const double one_target = one.accuracy.target().value_or(1e9), other_target = other.accuracy.target().value_or(1e9);
    return one_target != other_target ? one_target > other_target : one.accuracy.samples < other.accuracy.samples;
  };
  return *std::max_element(settings.begin(), settings.end(), coarser);
}

}  // namespace

MeasurementRun::MeasurementRun(const Scene& scene, const Assets& assets, MeasureSettings settings)
    : scene_(scene),
      assets_(assets),
      options_(std::move(settings)),
      settings_(tracer::settings(scene, options_.parameters)),
      points_(settings_.size()),
      reference_(empty_reference(scene, options_.reference_samples)) {}

void MeasurementRun::resume(Reference reference) {
  const auto same_size = [&](const std::vector<double>& sums) { return sums.size() == reference_.radiance_sum.size(); };
  if (reference.width != reference_.width || reference.height != reference_.height ||
      reference.image_samples != reference_.image_samples || !same_size(reference.radiance_sum) ||
      !same_size(reference.squared_sum) || (reference.complete && reference.images == 0))
    return;
  reference_ = std::move(reference);
  reference_display_.reset();
}

void MeasurementRun::resume(std::vector<MeasuredPoint> points) {
  for (MeasuredPoint& point : points)
    for (std::size_t i = 0; i < settings_.size(); ++i)
      if (settings_[i].parameter == point.setting.parameter && settings_[i].value == point.setting.value) {
        point.setting = settings_[i];
        points_[i] = point;
      }
}

std::size_t MeasurementRun::next_setting() const {
  const auto missing = std::find_if(points_.begin(), points_.end(), [](const auto& point) { return !point; });
  return static_cast<std::size_t>(missing - points_.begin());
}

std::vector<std::size_t> MeasurementRun::settings_to_time() const {
  std::vector<MeasuredPoint> points;
  double first_seconds = 0, all_seconds = 0;
  for (const auto& point : points_) {
    points.push_back(*point);
    first_seconds += point->runs.front();
    all_seconds += std::accumulate(point->runs.begin(), point->runs.end(), 0.0);
  }
  if (all_seconds - first_seconds >= std::max(repeat_seconds_min, repeat_share_max * first_seconds)) return {};
  std::vector<std::size_t> indices = unranked_points(points);
  std::erase_if(indices, [&](std::size_t index) { return points_[index]->runs.size() >= timing_runs_max; });
  return indices;
}

bool MeasurementRun::done() const {
  return reference_.complete && next_setting() == settings_.size() && settings_to_time().empty();
}

std::string MeasurementRun::next() const {
  assert(!done());
  if (!reference_.complete)
    return "reference, " + std::to_string(std::uint64_t{reference_.images} * reference_.image_samples) +
           " of at most " + std::to_string(options_.reference_samples) + " samples";
  if (next_setting() < settings_.size()) return title(settings_[next_setting()]);
  return "timings of " + std::to_string(settings_to_time().size()) + " settings";
}

/// Never falls, although a setting may be timed again that was certain before its neighbors' last runs.
std::size_t MeasurementRun::rounds_done() const {
  if (done()) return timing_runs_max - 1;
  std::size_t most_runs = 1;
  for (const auto& point : points_) most_runs = std::max(most_runs, point->runs.size());
  return std::min<std::size_t>(most_runs, timing_runs_max - 1) - 1;
}

std::size_t MeasurementRun::steps_done() const {
  const auto measured = static_cast<std::size_t>(
      std::count_if(points_.begin(), points_.end(), [](const auto& point) { return point.has_value(); }));
  const std::size_t images =
      reference_.complete ? options_.reference_samples / reference_.image_samples : reference_.images;
  return images + measured + (measured == settings_.size() ? rounds_done() : 0);
}

std::size_t MeasurementRun::steps() const {
  return options_.reference_samples / reference_.image_samples + settings_.size() + timing_runs_max - 1;
}

Result<MeasurementRun::Timed, Failure> MeasurementRun::render_timed(const Scene& scene, RenderControl& control) const {
  const double start = options_.seconds();
  const auto compiled = compile(scene, control, assets_);
  if (!compiled) return compiled.error();
  const auto elapsed_ms = [&] { return 1000 * (options_.seconds() - start); };
  auto rendered = render(**compiled, {.elapsed_ms = elapsed_ms, .threads = options_.threads}, control);
  if (!rendered) return std::move(rendered.error());
  return Timed{std::move(*rendered), options_.seconds() - start};
}

/// The fastest of the renders that fill `run_seconds_min`, of `renders_max` at most.
Result<double, Failure> MeasurementRun::time_run(const Scene& scene, RenderControl& control) const {
  double fastest = std::numeric_limits<double>::infinity(), spent = 0;
  for (int renders = 0; renders < renders_max && spent < run_seconds_min; ++renders) {
    const auto timed = render_timed(scene, control);
    if (!timed) return timed.error();
    fastest = std::min(fastest, timed->seconds);
    spent += timed->seconds;
  }
  return fastest;
}

/// Renders one setting and compares it with the complete reference.
Result<MeasuredPoint, Failure> MeasurementRun::measure(const Setting& setting, RenderControl& control) const {
  Scene varied = scene_;
  varied.accuracy = setting.accuracy;
  const auto timed = render_timed(varied, control);
  if (!timed) return timed.error();
  const RenderStatistics& statistics = timed->rendered.statistics;
  MeasuredPoint point{.setting = setting, .claimed = timed->rendered.error};
  if (timed->seconds >= run_seconds_min) {
    add_run(point, timed->seconds);
  } else {
    const auto seconds = time_run(varied, control);
    if (!seconds) return seconds.error();
    add_run(point, *seconds);
  }
  point.samples = statistics.samples;
  point.samples_mean = static_cast<double>(statistics.samples - statistics.holdout_samples) /
                       static_cast<double>(scene_.image.window().pixels());
  point.rays = statistics.rays;
  point.error = error_of(*reference_display_, standard_error(reference_, scene_.output),
                         to_display(timed->rendered.image, varied.output));
  return point;
}

std::optional<Failure> MeasurementRun::step(RenderControl& control) {
  assert(!done());
  try {
    if (!reference_.complete) return grow_reference(control);
    return next_setting() < settings_.size() ? measure_next(control) : repeat_timings(control);
  } catch (const std::bad_alloc&) {
    return no_memory;
  }
}

std::optional<Failure> MeasurementRun::measure_next(RenderControl& control) {
  if (!reference_display_) reference_display_ = to_display(reference_, scene_.output);
  const std::size_t index = next_setting();
  auto point = measure(settings_[index], control);
  if (!point) return std::move(point.error());
  points_[index] = std::move(*point);
  return std::nullopt;
}

/// One run of each setting in turn: the load of the machine affects all runs of a round alike. A failure keeps the runs
/// before it.
std::optional<Failure> MeasurementRun::repeat_timings(RenderControl& control) {
  for (const std::size_t index : settings_to_time()) {
    Scene varied = scene_;
    varied.accuracy = settings_[index].accuracy;
    const auto seconds = time_run(varied, control);
    if (!seconds) return seconds.error();
    add_run(*points_[index], *seconds);
  }
  return std::nullopt;
}

std::optional<Failure> MeasurementRun::grow_reference(RenderControl& control) {
  if (reference_.images < options_.reference_samples / reference_.image_samples) {
    auto timed = render_timed(reference_scene(scene_, reference_), control);
    if (!timed) return std::move(timed.error());
    add(reference_, timed->rendered.image);
  }
  return check_reference(control);
}

/// Sets `complete` once the reference is accurate enough or has all its samples.
std::optional<Failure> MeasurementRun::check_reference(RenderControl& control) {
  if (reference_.images >= options_.reference_samples / reference_.image_samples) {
    reference_.complete = true;
    return std::nullopt;
  }
  if (reference_.images < images_min || settings_.empty()) return std::nullopt;
  if (!finest_) {
    Scene varied = scene_;
    varied.accuracy = finest(settings_).accuracy;
    auto timed = render_timed(varied, control);
    if (!timed) return std::move(timed.error());
    finest_ = to_display(timed->rendered.image, scene_.output);
  }
  const double own = standard_error(reference_, scene_.output);
  reference_.complete = own <= reference_share * error_of(to_display(reference_, scene_.output), own, *finest_);
  return std::nullopt;
}

Measurement MeasurementRun::measurement() const {
  Measurement found{.name = scene_.name, .width = reference_.width, .height = reference_.height};
  found.reference_samples = reference_.images * reference_.image_samples;
  if (reference_.images > 1) found.reference_error = standard_error(reference_, scene_.output);
  for (const auto& point : points_)
    if (point) found.points.push_back(*point);
  return found;
}

}  // namespace tracer
