// Settings that a measurement of a scene covers.
#include <algorithm>
#include <functional>
#include <utility>

#include "tracer/limits.h"
#include "tracer/measurement.h"
#include "tracer/requirements.h"
#include "tracer/validate.h"

namespace tracer {
namespace {

/// The same accuracy with fixed samples (no `adaptive`) or adaptive ones.
Accuracy with_sampling(Accuracy accuracy, const std::optional<Adaptive>& adaptive) {
  accuracy.samples = Accuracy().samples;
  accuracy.target_error.reset();
  accuracy.tile_error.reset();
  accuracy.adaptive = adaptive;
  return accuracy;
}

class SettingList {
 public:
  explicit SettingList(const Scene& scene)
      : scene_(scene),
        needs_(exact_requirements(scene)),
        baseline_(with_sampling(scene.accuracy, std::nullopt)),
        adaptive_(scene.accuracy.adaptive.value_or(Adaptive())) {
    baseline_.samples = baseline_samples;
    if (scene.accuracy.adaptive) return;
    adaptive_.tile_error = scene.accuracy.tile_error;
    adaptive_.samples_max =
        bounded_samples(adaptive_.samples_max, adaptive_.samples_min, scene.image.window().pixels());
  }

  void add(std::string_view parameter) {
    const bool branches = has_secondary_rays(needs_);
    if (parameter == "target_error") targets();
    if (parameter == "samples") vary(parameter, &Accuracy::samples, {1u, 4u, 16u, 64u});
    if (parameter == "max_depth" && branches) vary(parameter, &Accuracy::max_depth, {1u, 2u, 4u, 8u});
    if (parameter == "cutoff" && branches) vary(parameter, &Accuracy::cutoff, {0.1, 0.01, 0.001, 0.0001});
    if (parameter == "approximate") approximations();
    if (parameter == "model") models();
    if (parameter == "document") add_baseline();
    if (parameter == "document" && !has(scene_.accuracy))
      settings_.push_back({"document", "as it is", scene_.accuracy});
  }

  std::vector<Setting> take() {
    add_baseline();
    return std::move(settings_);
  }

 private:
  /// Adds the baseline if a setting varies it.
  void add_baseline() {
    const bool from_baseline =
        std::ranges::any_of(settings_, [](const Setting& setting) { return is_change(setting.parameter); });
    if (from_baseline && !has(baseline_)) vary("samples", &Accuracy::samples, {baseline_samples});
  }

  static bool is_change(std::string_view parameter) {
    return parameter == "max_depth" || parameter == "cutoff" || parameter == "approximate";
  }

  [[nodiscard]] bool has(const Accuracy& accuracy) const {
    return std::ranges::any_of(
        settings_, [&](const Setting& setting) { return setting.model.empty() && setting.accuracy == accuracy; });
  }

  /// The accuracy of the document with this target error.
  [[nodiscard]] Accuracy with_target(double target) const {
    Adaptive adaptive = adaptive_;
    adaptive.target_error = target;
    return with_sampling(scene_.accuracy, adaptive);
  }

  void targets() {
    std::vector<double> selected{8, 4, 2, 1, 0.5, 0.25};
    for (const auto& [name, preset] : words<Preset>) selected.push_back(target_error_of(preset));
    std::ranges::sort(selected, std::greater<>());
    selected.erase(std::unique(selected.begin(), selected.end()), selected.end());
    for (const double target : selected) {
      Setting setting{"target_error", text_of(target, 6), with_target(target)};
      for (const auto& [name, preset] : words<Preset>)
        if (target_error_of(preset) == target) setting.preset = name;
      settings_.push_back(std::move(setting));
    }
  }

  /// The baseline with each value of one member.
  template <class Member, class Value>
  void vary(std::string_view parameter, Member Accuracy::*member, std::initializer_list<Value> values) {
    for (const Value value : values) {
      settings_.push_back({std::string(parameter), text_of(value, 6), baseline_});
      settings_.back().accuracy.*member = value;
    }
  }

  /// Each model with the baseline's samples and with targets.
  void models() {
    const bool refused = refusal_of_global(scene_).has_value();
    for (const std::string_view model : light_models) {
      if (refused && model != "whitted") continue;
      using Interreflection = Approximations::Interreflection;
      const bool is_whitted = model == "whitted" || model == "fitted ambient";
      const auto kind = is_whitted ? Accuracy::Model::whitted : Accuracy::Model::global;
      const std::string name(model);
      const auto add = [&](const std::string& value, Accuracy accuracy) {
        accuracy.model = kind;
        accuracy.approximate = {};
        if (model == "radiosity") accuracy.approximate.interreflection = Interreflection::radiosity;
        if (model == "gather") accuracy.approximate.interreflection = Interreflection::gather;
        std::string label = name;
        label.append(": ").append(value);
        settings_.push_back({"model", std::move(label), accuracy, {}, name});
      };
      add(std::to_string(baseline_samples) + " samples", baseline_);
      for (const double target : {4.0, 1.0, 0.5}) add("target " + text_of(target, 6), with_target(target));
    }
  }

  /// The baseline with one approximation changed, unless it has that already.
  template <class Value>
  void approximate(const std::string& value, Value Approximations::*member, Value by) {
    if (baseline_.approximate.*member == by) return;
    settings_.push_back({"approximate", value, baseline_});
    settings_.back().accuracy.approximate.*member = by;
  }

  void approximations() {
    using A = Approximations;
    if (baseline_.approximate.any()) {
      settings_.push_back({"approximate", "all exact", baseline_});
      settings_.back().accuracy.approximate = {};
    }
    if (needs_.shadows) {
      approximate("shadows: map", &A::shadows, A::Shadows::map);
      approximate("shadows: none", &A::shadows, A::Shadows::none);
    }
    if (needs_.reflection || needs_.refraction) {
      if (has_background()) approximate("reflections: environment", &A::reflections, A::Reflections::environment);
      approximate("reflections: none", &A::reflections, A::Reflections::none);
    }
    if (needs_.principled) approximate("mirror_roughness: 1", &A::mirror_roughness, 1.0);
    if (needs_.triangles) approximate("shading: gouraud", &A::shading, A::Shading::gouraud);
    if (needs_.smooth_normals || needs_.gouraud) approximate("shading: flat", &A::shading, A::Shading::flat);
    if (needs_.global_light)
      for (const auto& [name, by] : words<A::Interreflection>)
        approximate("interreflection: " + std::string(name), &A::interreflection, by);
    const auto somewhere = std::ranges::count_if(
        scene_.lights, [](const Light& light) { return !std::holds_alternative<DirectionalLight>(light.source); });
    for (const std::uint32_t count : {1u, 4u, 16u, 64u})
      if (std::cmp_less(count, somewhere))
        approximate("lights: nearest-" + std::to_string(count), &A::nearest_lights, count);
  }

  /// False for a black background, which gives the same image as no reflections.
  [[nodiscard]] bool has_background() const {
    const Background& background = scene_.background;
    return background.gradient || background.environment || background.cube || !(background.color == Color{});
  }

  const Scene& scene_;
  Requirements needs_;
  Accuracy baseline_;
  Adaptive adaptive_;  ///< base of the settings with a target error
  std::vector<Setting> settings_;
};

}  // namespace

std::vector<Setting> settings(const Scene& scene, std::span<const std::string> selected) {
  SettingList list(scene);
  const bool all_have_model = scene.accuracy.model == Accuracy::Model::global;
  for (const std::string_view parameter : parameters)
    if ((selected.empty() && (parameter != "model" || all_have_model)) ||
        std::ranges::find(selected, parameter) != selected.end())
      list.add(parameter);
  return list.take();
}

std::optional<std::string> refusal_of_global(const Scene& scene) {
  Scene global = scene;
  global.accuracy = {};
  global.accuracy.model = Accuracy::Model::global;
  // The caller has checked limits.
  const auto issues = validate(global, Limits(), [](const Issue& issue) { return issue.code == "limit_exceeded"; });
  if (issues.empty()) return std::nullopt;
  return issues.front().pointer + " " + issues.front().detail;
}

std::string title(const Setting& setting) {
  const std::string value = setting.parameter + " " + setting.value;
  return setting.preset.empty() ? value : value + " (" + setting.preset + ")";
}

}  // namespace tracer
