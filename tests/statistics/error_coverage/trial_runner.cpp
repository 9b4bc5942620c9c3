#include "tests/statistics/error_coverage/trial_runner.h"

#include <chrono>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "tracer/encode.h"
#include "tracer/render.h"

namespace error_coverage {

using namespace tracer;

namespace {

Rendered render_scene(const Scene& scene, const Assets& assets, Renderer renderer) {
  const auto start = std::chrono::steady_clock::now();
  RenderControl control;
  const auto compiled = compile(scene, control, assets);
  if (!compiled) throw std::runtime_error(compiled.error().detail);
  const RenderSettings settings{
      .elapsed_ms =
          [start] {
            return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
          },
      .threads = 0};
  auto rendered = renderer(**compiled, settings, control);
  if (!rendered) throw std::runtime_error(rendered.error().detail);
  return std::move(*rendered);
}

/// The defaults of a document.
Accuracy accuracy_of(const Setting& setting, const Approximations& approximate, std::uint64_t seed) {
  Accuracy accuracy;
  accuracy.seed = seed;
  accuracy.approximate = approximate;
  if (setting.samples > 0) {
    accuracy.samples = setting.samples;
    return accuracy;
  }
  accuracy.adaptive = Adaptive{.target_error = setting.target_error, .time_budget_ms = setting.time_budget_ms};
  return accuracy;
}

/// Worst tile of the layer `error`, in levels.
double claimed_tile_error(const Image& image) {
  std::vector<double> squared;
  for (const float error : image.layers.error) squared.push_back(double{error} * error);
  return std::sqrt(worst_tile_mean(squared, image.width));
}

struct FileKind {
  const char* name;
  Format format;
  std::uint32_t palette;
};
constexpr FileKind file_kinds[] = {{"PNG", Format::png, 0},
                                   {"PNG, 64 colors", Format::png, 64},
                                   {"PNG, 16 colors", Format::png, 16},
                                   {"PNG, 16 bits", Format::png16, 0},
                                   {"JPEG", Format::jpg, 0},
                                   {"WebP", Format::webp, 0}};

}  // namespace

std::string Setting::name() const {
  std::ostringstream text;
  if (samples > 0) {
    text << samples << " samples";
  } else if (time_budget_ms) {
    text << "budget " << *time_budget_ms << " ms";
  } else {
    text << "target " << target_error.value_or(0);
  }
  return text.str();
}

std::vector<Setting> settings_of(SettingGroup group) {
  const auto target = [](double levels) { return Setting{.target_error = levels}; };
  const auto budget = [](double ms) { return Setting{.time_budget_ms = ms}; };
  const auto samples = [](std::uint32_t count) { return Setting{.samples = count}; };
  switch (group) {
    case SettingGroup::targets:
      return {target(4), target(2), target(1), target(0.5)};
    case SettingGroup::budgets:
      return {target(4), target(1), budget(50), budget(200)};
    case SettingGroup::fixed_samples:
      return {samples(1), samples(2), samples(4), samples(8), samples(16), samples(32), samples(64)};
    case SettingGroup::tiles:
      return {target(4), target(2), target(1)};
    case SettingGroup::noisy_tiles:
      return {target(16), target(8), target(4)};
    case SettingGroup::bounds:
      return {target(4), samples(4), samples(16)};
    case SettingGroup::files:
      return {target(1), target(0.25)};
  }
  return {};
}

Setting random_setting(oracle::Random& random) {
  const double kind = random.in(0, 1);
  if (kind < 0.2) return {.samples = static_cast<std::uint32_t>(std::lround(random.spread(1, 64)))};
  if (kind < 0.35) return {.time_budget_ms = random.spread(50, 300)};
  return {.target_error = random.spread(0.3, 5)};
}

TrialRunner::TrialRunner(const CorpusEntry& entry, Canvas canvas, const CorpusScene& scene, double reference_samples)
    : entry_(entry), canvas_(canvas), scene_(scene), truth_(truth_of(scene, reference_samples)) {}

std::vector<Trial> TrialRunner::run(const Setting& setting, std::uint64_t seed, Renderer renderer) const {
  Scene scene = scene_.scene;
  scene.accuracy = accuracy_of(setting, scene_.scene.accuracy.approximate, seed);
  scene.accuracy.model = scene_.scene.accuracy.model;
  scene.accuracy.proof = seed % 2 == 0;
  if (entry_.settings == SettingGroup::bounds) {
    scene.accuracy.max_depth = scene_.scene.accuracy.max_depth;
    scene.accuracy.cutoff = scene_.scene.accuracy.cutoff;
  }
  if (measures_tiles(entry_.settings)) scene.output.layers = {Layer::error};
  const Rendered rendered = render_scene(scene, scene_.assets, renderer);
  Trial trial{entry_.family, entry_.name, setting.name(), canvas_, seed};
  trial.claimed = rendered.error.estimate;
  trial.proven = rendered.error.proven;
  trial.target = rendered.error.target;
  trial.target_met = rendered.error.target_met;
  trial.error = truth_.error_of(to_display(rendered.image, scene.output));
  trial.samples_per_pixel =
      static_cast<double>(rendered.statistics.samples) / static_cast<double>(scene.image.window().pixels());
  if (entry_.settings == SettingGroup::files) return file_trials(rendered, trial);
  std::vector<Trial> trials{trial};
  if (measures_tiles(entry_.settings)) {
    trial.scene += ", worst tile";
    trial.target.reset();
    trial.proven = std::numeric_limits<double>::infinity();
    trial.claimed = claimed_tile_error(rendered.image);
    trial.error.squared = trial.error.worst_tile;
    trials.push_back(trial);
  }
  return trials;
}

std::vector<Trial> TrialRunner::file_trials(const Rendered& rendered, const Trial& of_image) const {
  std::vector<Trial> trials;
  for (const FileKind& kind : file_kinds) {
    Output output = scene_.scene.output;
    output.palette = kind.palette;
    const auto encoded = encode(rendered.image, kind.format, output);
    if (!encoded) throw std::runtime_error(encoded.error());
    const auto file = read_image(encoded->bytes);
    if (!file) throw std::runtime_error(file.error());
    Trial trial = of_image;
    trial.scene += std::string(", ") + kind.name;
    const FileError claimed = file_error(rendered.error, encoded->error);
    trial.claimed = claimed.estimate;
    trial.target_met = claimed.target_met;
    trial.proven = std::numeric_limits<double>::infinity();
    trial.error = truth_.error_of(file->image);
    trials.push_back(trial);
  }
  return trials;
}

}  // namespace error_coverage
