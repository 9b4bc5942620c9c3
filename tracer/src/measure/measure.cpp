// Measures the settings one after another.
#include "tracer/measure.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <new>
#include <numeric>
#include <utility>

#include "tracer/compare.h"
#include "tracer/src/measure/model_comparison.h"
#include "tracer/src/measure/time_ranking.h"

namespace tracer {
namespace {

constexpr std::string_view fitted_ambient = "fitted ambient";
constexpr std::uint32_t images_min = 4;   // for a usable variance
constexpr double reference_share = 0.1;   // maximum standard error, relative to the error of the finest setting
constexpr double run_seconds_min = 0.02;  // caches and interrupts dominate shorter renders
constexpr int renders_max = 100;          // of one run
constexpr double repeat_share_max = 2;    // time of the repeated runs, relative to the first ones
constexpr double repeat_seconds_min = 10;
const Failure no_memory{Failure::Code::out_of_memory, "no memory for the images to compare"};

void add_run(MeasuredPoint& point, double seconds) {
  point.runs.push_back(seconds);
  point.seconds = std::ranges::min(point.runs);
}

/// The error of a point that the references show. One that is not above their own error becomes that, and a limit.
double shown_error(const char* name, double error, double reference_error, MeasuredPoint& point) {
  if (reference_error > 0 && error <= reference_error) point.upper_limits.emplace_back(name);
  return std::max(error, reference_error);
}

/// The setting of the model with the smallest expected error; null if there is none.
const Setting* finest(const std::vector<Setting>& settings, Accuracy::Model model) {
  const auto coarser = [](const Setting& one, const Setting& other) {
    const bool one_exact = !one.accuracy.approximate.any(), other_exact = !other.accuracy.approximate.any();
    if (one_exact != other_exact) return other_exact;
    const double one_target = one.accuracy.target().value_or(1e9), other_target = other.accuracy.target().value_or(1e9);
    return one_target != other_target ? one_target > other_target : one.accuracy.samples < other.accuracy.samples;
  };
  const Setting* found = nullptr;
  for (const Setting& setting : settings)
    if (setting.accuracy.model == model && (found == nullptr || coarser(*found, setting))) found = &setting;
  return found;
}

/// The document's reference, and that of the other model if settings have to be compared with both.
std::vector<Reference> empty_references(const Scene& scene, const MeasureSettings& options,
                                        const std::vector<Setting>& settings) {
  std::vector<Reference> references{empty_reference(scene, options.reference_samples)};
  const bool compares = std::ranges::any_of(settings, [](const Setting& setting) { return setting.model == "path"; });
  if (compares) {
    using enum Accuracy::Model;
    references.push_back(references.front());
    references.back().model = scene.accuracy.model == whitted ? global : whitted;
  }
  return references;
}

}  // namespace

MeasurementRun::MeasurementRun(const Scene& scene, const Assets& assets, MeasureSettings settings)
    : scene_(scene),
      assets_(assets),
      options_(std::move(settings)),
      settings_(tracer::settings(scene, options_.parameters)),
      points_(settings_.size()),
      references_(empty_references(scene, options_, settings_)),
      images_(references_.size()) {}

MeasurementRun::~MeasurementRun() = default;

void MeasurementRun::resume(Reference reference) {
  const std::size_t index = reference_of(reference.model);
  if (index == references_.size()) return;
  const Reference& own = references_[index];
  const auto same_size = [&](const std::vector<double>& sums) { return sums.size() == own.radiance_sum.size(); };
  if (reference.width != own.width || reference.height != own.height || reference.image_samples != own.image_samples ||
      !same_size(reference.radiance_sum) || !same_size(reference.squared_sum) ||
      (reference.complete && reference.images == 0))
    return;
  references_[index] = std::move(reference);
  images_[index].mean.reset();
  comparison_.reset();
}

void MeasurementRun::resume(std::vector<MeasuredPoint> points) {
  for (MeasuredPoint& point : points)
    for (std::size_t i = 0; i < settings_.size(); ++i) {
      const Setting& setting = settings_[i];
      if (setting.parameter != point.setting.parameter || setting.value != point.setting.value) continue;
      const bool complete = setting.model.empty() ? reference().complete : next_reference() == references_.size();
      if (!complete) continue;
      point.setting = setting;
      points_[i] = point;
    }
}

std::size_t MeasurementRun::next_reference() const {
  return static_cast<std::size_t>(std::ranges::find(references_, false, &Reference::complete) - references_.begin());
}

std::size_t MeasurementRun::reference_of(Accuracy::Model model) const {
  return static_cast<std::size_t>(std::ranges::find(references_, model, &Reference::model) - references_.begin());
}

bool MeasurementRun::needs_comparison() const { return references_.size() > 1 && comparison_ == nullptr; }

std::size_t MeasurementRun::next_setting() const {
  const auto missing = std::ranges::find_if(points_, [](const auto& point) { return !point; });
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
  return next_reference() == references_.size() && !needs_comparison() && next_setting() == settings_.size() &&
         settings_to_time().empty();
}

std::string MeasurementRun::next() const {
  assert(!done());
  if (const std::size_t index = next_reference(); index < references_.size()) {
    const Reference& grown = references_[index];
    const char* const of = references_.size() == 1                  ? "reference, "
                           : grown.model == Accuracy::Model::global ? "reference of the rendering equation, "
                                                                    : "reference of Whitted's model, ";
    return of + std::to_string(std::uint64_t{grown.images} * grown.image_samples) + " of at most " +
           std::to_string(options_.reference_samples) + " samples";
  }
  if (needs_comparison()) return "comparison of the models";
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
  const auto measured =
      static_cast<std::size_t>(std::ranges::count_if(points_, [](const auto& point) { return point.has_value(); }));
  std::size_t done = measured + (references_.size() > 1 && !needs_comparison() ? 1 : 0);
  for (const Reference& each : references_)
    done += each.complete ? options_.reference_samples / each.image_samples : each.images;
  return done + (measured == settings_.size() && next_reference() == references_.size() ? rounds_done() : 0);
}

std::size_t MeasurementRun::steps() const {
  const std::size_t references = references_.size() * (options_.reference_samples / reference().image_samples);
  return references + (references_.size() > 1 ? 1 : 0) + settings_.size() + timing_runs_max - 1;
}

Scene MeasurementRun::varied(const Setting& setting) const {
  Scene scene = scene_;
  scene.accuracy = setting.accuracy;
  if (setting.model == fitted_ambient) scene.ambient = comparison_->error.fitted_ambient;
  return scene;
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
Result<MeasuredPoint, Failure> MeasurementRun::measure(const Setting& setting, RenderControl& control) {
  const Scene scene = varied(setting);
  const auto timed = render_timed(scene, control);
  if (!timed) return timed.error();
  const RenderStatistics& statistics = timed->rendered.statistics;
  MeasuredPoint point{.setting = setting, .claimed = timed->rendered.error};
  if (timed->seconds >= run_seconds_min) {
    add_run(point, timed->seconds);
  } else {
    const auto seconds = time_run(scene, control);
    if (!seconds) return seconds.error();
    add_run(point, *seconds);
  }
  point.samples = statistics.samples;
  point.samples_mean = static_cast<double>(statistics.samples - statistics.holdout_samples) /
                       static_cast<double>(scene_.image.window().pixels());
  point.rays = statistics.rays;
  const DisplayImage image = to_display(timed->rendered.image, scene_.output);
  add_errors(image, point);
  if (!point.model_error || !setting.accuracy.approximate.any()) return point;
  Scene again = scene;
  again.accuracy.seed = ~scene.accuracy.seed;
  const auto other = render_timed(again, control);
  if (!other) return other.error();
  const std::size_t global = reference_of(Accuracy::Model::global);
  const double global_error = standard_error(references_[global], scene_.output);
  const double common =
      common_distance(mean_display(global), global_error, image, to_display(other->rendered.image, scene_.output));
  point.model_error = shown_error("model_error", common, comparison_->error.standard_error, point);
  return point;
}

const DisplayImage& MeasurementRun::mean_display(std::size_t reference) {
  auto& mean = images_[reference].mean;
  if (!mean) mean = to_display(references_[reference], scene_.output);
  return *mean;
}

void MeasurementRun::add_errors(const DisplayImage& image, MeasuredPoint& point) {
  const Setting& setting = point.setting;
  const std::size_t own = reference_of(setting.accuracy.model);
  const bool is_fitted = setting.model == fitted_ambient;
  const double own_error = standard_error(references_[own], scene_.output);
  const double error = distance(is_fitted ? comparison_->fitted : mean_display(own), own_error, image);
  const auto* const compared = setting.model.empty() ? nullptr : comparison_.get();
  const double least = compared != nullptr ? compared->error.standard_error : own_error;
  point.error = shown_error("error", error, least, point);
  if (compared == nullptr) return;
  const std::size_t global = reference_of(Accuracy::Model::global);
  const double total = distance(mean_display(global), standard_error(references_[global], scene_.output), image);
  point.total_error = shown_error("total_error", total, least, point);
  const double levels = is_fitted ? compared->error.fitted_levels : compared->error.levels;
  point.model_error = own == global ? 0 : shown_error("model_error", levels, least, point);
}

std::optional<Failure> MeasurementRun::step(RenderControl& control) {
  assert(!done());
  try {
    if (const std::size_t index = next_reference(); index < references_.size()) return grow_reference(index, control);
    if (needs_comparison()) return compare(control);
    return next_setting() < settings_.size() ? measure_next(control) : repeat_timings(control);
  } catch (const std::bad_alloc&) {
    return no_memory;
  }
}

std::optional<Failure> MeasurementRun::compare(RenderControl& control) {
  const auto image = [&](const Scene& scene) -> Result<Image, Failure> {
    auto timed = render_timed(scene, control);
    if (!timed) return std::move(timed.error());
    return std::move(timed->rendered.image);
  };
  using enum Accuracy::Model;
  auto compared = compare_models(scene_, references_[reference_of(whitted)], references_[reference_of(global)], image);
  if (!compared) return std::move(compared.error());
  comparison_ = std::make_unique<ModelComparison>(std::move(*compared));
  return std::nullopt;
}

std::optional<Failure> MeasurementRun::measure_next(RenderControl& control) {
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
    const auto seconds = time_run(varied(settings_[index]), control);
    if (!seconds) return seconds.error();
    add_run(*points_[index], *seconds);
  }
  return std::nullopt;
}

std::optional<Failure> MeasurementRun::grow_reference(std::size_t index, RenderControl& control) {
  Reference& grown = references_[index];
  if (grown.images < options_.reference_samples / grown.image_samples) {
    auto timed = render_timed(reference_scene(scene_, grown), control);
    if (!timed && index > 0 && timed.error().code == Failure::Code::bad_asset) {
      leave_out_global(timed.error());
      return std::nullopt;
    }
    if (!timed) return std::move(timed.error());
    add(grown, timed->rendered.image);
  }
  return check_reference(index, control);
}

/// The second reference is that of the rendering equation: Whitted's model, which has been rendered, accepts all files.
void MeasurementRun::leave_out_global(const Failure& failure) {
  refusal_ = failure.pointer + ": " + failure.detail;
  references_.resize(1);
  images_.resize(1);
  for (std::size_t i = settings_.size(); i-- > 0;)
    if (!settings_[i].model.empty() && settings_[i].model != "whitted") {
      settings_.erase(settings_.begin() + static_cast<std::ptrdiff_t>(i));
      points_.erase(points_.begin() + static_cast<std::ptrdiff_t>(i));
    }
}

/// Sets `complete` once the reference is accurate enough or has all its samples.
std::optional<Failure> MeasurementRun::check_reference(std::size_t index, RenderControl& control) {
  Reference& grown = references_[index];
  if (grown.images >= options_.reference_samples / grown.image_samples) {
    grown.complete = true;
    return std::nullopt;
  }
  const Setting* const setting = finest(settings_, grown.model);
  if (grown.images < images_min || setting == nullptr) return std::nullopt;
  std::optional<DisplayImage>& finest_image = images_[index].finest;
  if (!finest_image) {
    Scene scene = scene_;
    scene.accuracy = setting->accuracy;
    auto timed = render_timed(scene, control);
    if (!timed) return std::move(timed.error());
    finest_image = to_display(timed->rendered.image, scene_.output);
  }
  const double own = standard_error(grown, scene_.output);
  grown.complete = own <= reference_share * distance(to_display(grown, scene_.output), own, *finest_image);
  return std::nullopt;
}

Measurement MeasurementRun::measurement() const {
  const Reference& own = reference();
  Measurement found{.name = scene_.name, .width = own.width, .height = own.height};
  found.reference_samples = own.images * own.image_samples;
  if (own.images > 1) found.reference_error = standard_error(own, scene_.output);
  if (comparison_ != nullptr) found.model_error = comparison_->error;
  const bool has_models = std::ranges::any_of(settings_, [](const Setting& setting) { return !setting.model.empty(); });
  if (has_models && references_.size() == 1) found.not_measured = refusal_ ? refusal_ : refusal_of_global(scene_);
  for (const auto& point : points_)
    if (point) found.points.push_back(*point);
  return found;
}

}  // namespace tracer
