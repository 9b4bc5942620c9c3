// Settings that a measurement of a scene covers.
#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <utility>

#include "tracer/limits.h"
#include "tracer/measurement.h"
#include "tracer/requirements.h"
#include "tracer/validate.h"

namespace tracer {
namespace {

constexpr std::array<std::pair<const char*, Preset>, 4> presets{{{"draft", Preset::draft},
                                                                 {"standard", Preset::standard},
                                                                 {"fine", Preset::fine},
                                                                 {"reference", Preset::reference}}};

std::string text(double number) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%g", number);
  return buffer.data();
}

class SettingList {
 public:
  explicit SettingList(const Scene& scene) : scene_(scene), needs_(exact_requirements(scene)) {
    baseline_.model = scene.accuracy.model;
    baseline_.samples = baseline_samples;
    baseline_.seed = scene.accuracy.seed;
  }

  void add(std::string_view parameter) {
    const bool branches = has_secondary_rays(needs_);
    if (parameter == "target_error") targets();
    if (parameter == "samples") vary(parameter, &Accuracy::samples, {1u, 4u, 16u, 64u});
    if (parameter == "max_depth" && branches) vary(parameter, &Accuracy::max_depth, {1u, 2u, 4u, 8u});
    if (parameter == "cutoff" && branches) vary(parameter, &Accuracy::cutoff, {0.1, 0.01, 0.001, 0.0001});
    if (parameter == "approximate") approximations();
    if (parameter == "model") models();
    if (parameter == "document" && !has(scene_.accuracy))
      settings_.push_back({"document", "as it is", scene_.accuracy});
  }

  std::vector<Setting> take() {
    const bool from_baseline = std::any_of(settings_.begin(), settings_.end(),
                                           [](const Setting& setting) { return is_change(setting.parameter); });
    if (from_baseline && !has(baseline_)) vary("samples", &Accuracy::samples, {baseline_samples});
    return std::move(settings_);
  }

 private:
  static bool is_change(std::string_view parameter) {
    return parameter == "max_depth" || parameter == "cutoff" || parameter == "approximate";
  }

  [[nodiscard]] bool has(const Accuracy& accuracy) const {
    return std::any_of(settings_.begin(), settings_.end(),
                       [&](const Setting& setting) { return setting.model.empty() && setting.accuracy == accuracy; });
  }

  /// The accuracy of a document that contains only this target error, and its model.
  [[nodiscard]] Accuracy with_target(double target, Accuracy::Model model) const {
    Accuracy accuracy;
    accuracy.model = model;
    accuracy.seed = baseline_.seed;
    accuracy.cutoff_by_chance = true;
    accuracy.adaptive.emplace().target_error = target;
    return accuracy;
  }

  void targets() {
    std::vector<double> selected{8, 4, 2, 1, 0.5, 0.25};
    for (const auto& [name, preset] : presets) selected.push_back(target_error_of(preset));
    std::sort(selected.begin(), selected.end(), std::greater<>());
    selected.erase(std::unique(selected.begin(), selected.end()), selected.end());
    for (const double target : selected) {
      Setting setting{"target_error", text(target), with_target(target, baseline_.model)};
      for (const auto& [name, preset] : presets)
        if (target_error_of(preset) == target) setting.preset = name;
      settings_.push_back(std::move(setting));
    }
  }

  /// The baseline with each value of one member.
  template <class Value>
  void vary(std::string_view parameter, Value Accuracy::*member, std::initializer_list<Value> values) {
    for (const Value value : values) {
      settings_.push_back({std::string(parameter), text(value), baseline_});
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
        if (model == "radiosity") accuracy.approximate.interreflection = Interreflection::radiosity;
        if (model == "gather") accuracy.approximate.interreflection = Interreflection::gather;
        std::string label = name;
        label.append(": ").append(value);
        settings_.push_back({"model", std::move(label), accuracy, {}, name});
      };
      Accuracy uniform = baseline_;
      uniform.model = kind;
      add(std::to_string(baseline_samples) + " samples", uniform);
      for (const double target : {4.0, 1.0, 0.5}) add("target " + text(target), with_target(target, kind));
    }
  }

  void approximate(const std::string& value, const Approximations& by) {
    settings_.push_back({"approximate", value, baseline_});
    settings_.back().accuracy.approximate = by;
  }

  void approximations() {
    using A = Approximations;
    if (needs_.shadows) {
      approximate("shadows: map", {.shadows = A::Shadows::map});
      approximate("shadows: none", {.shadows = A::Shadows::none});
    }
    if (needs_.reflection || needs_.refraction) {
      if (has_background()) approximate("reflections: environment", {.reflections = A::Reflections::environment});
      approximate("reflections: none", {.reflections = A::Reflections::none});
    }
    if (needs_.triangles) approximate("shading: gouraud", {.shading = A::Shading::gouraud});
    if (needs_.smooth_normals || needs_.gouraud) approximate("shading: flat", {.shading = A::Shading::flat});
    if (needs_.global_light) {
      approximate("interreflection: gather", {.interreflection = A::Interreflection::gather});
      approximate("interreflection: radiosity", {.interreflection = A::Interreflection::radiosity});
      approximate("interreflection: ambient", {.interreflection = A::Interreflection::ambient});
      approximate("interreflection: none", {.interreflection = A::Interreflection::none});
    }
    const auto somewhere = std::count_if(scene_.lights.begin(), scene_.lights.end(), [](const Light& light) {
      return !std::holds_alternative<DirectionalLight>(light.source);
    });
    for (const std::uint32_t count : {1u, 4u, 16u, 64u})
      if (std::cmp_less(count, somewhere))
        approximate("lights: nearest-" + std::to_string(count), {.nearest_lights = count});
  }

  /// False for a black background, which gives the same image as no reflections.
  [[nodiscard]] bool has_background() const {
    const Background& background = scene_.background;
    return background.gradient || background.environment || background.cube || !(background.color == Color{});
  }

  const Scene& scene_;
  Requirements needs_;
  Accuracy baseline_;
  std::vector<Setting> settings_;
};

}  // namespace

std::vector<Setting> settings(const Scene& scene, std::span<const std::string> selected) {
  SettingList list(scene);
  const bool all_have_model = scene.accuracy.model == Accuracy::Model::global;
  for (const std::string_view parameter : parameters)
    if ((selected.empty() && (parameter != "model" || all_have_model)) ||
        std::find(selected.begin(), selected.end(), parameter) != selected.end())
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
