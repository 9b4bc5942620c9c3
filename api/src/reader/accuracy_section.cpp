/// Requested accuracy: the fields of the section, then the settings that result from them together.

#include <array>
#include <charconv>
#include <string>

#include "api/src/reader/fields.h"
#include "api/src/reader/issue_text.h"
#include "api/src/reader/sections.h"

namespace api {

using tracer::Accuracy;
using tracer::Approximations;
using tracer::Preset;

namespace {

/// The fields as written; unset, or the default, if they are absent or invalid.
struct RequestedAccuracy {
  std::optional<Preset> preset;
  std::optional<double> target_error, tile_error, time_budget_ms;
  std::array<std::uint32_t, 2> samples{tracer::Adaptive{}.samples_min, tracer::Adaptive{}.samples_max};
  bool cutoff = false, max_depth = false;

  [[nodiscard]] bool exact() const { return samples[0] == samples[1]; }
};

/// `n` stands for `[n, n]`.
void read_samples(Reading& reading, const Cursor& at, std::array<std::uint32_t, 2>& samples) {
  std::array<std::uint32_t, 2> range{};
  if (at.node->kind == json::Kind::number) {
    if (read(reading, at, Integer<std::uint32_t>{range[0], 1})) samples = {range[0], range[0]};
    return;
  }
  bool valid = expect_length(reading, at, 2, "N or [MIN, MAX]");
  if (!valid) return;
  for_each_element(reading, at, [&](const Cursor& element) {
    valid &= read(reading, element, Integer<std::uint32_t>{range[element.index], 1});
  });
  if (valid) samples = range;
}

/// With exact samples the scene has no time budget that tracer::validate could check.
void read_time_budget(Reading& reading, const Cursor& at, RequestedAccuracy& requested) {
  double& budget = requested.time_budget_ms.emplace();
  if (read(reading, at, budget) && requested.exact() && budget <= 0)
    add_issue(reading, at, "out_of_range", "must be > 0, got " + number_text(budget));
}

/// "nearest-8".
bool read_nearest_lights(Reading& reading, const Cursor& at, std::uint32_t& count) {
  constexpr std::string_view prefix = "nearest-";
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "a string");
  const std::string_view text = at.node->string();
  if (text.starts_with(prefix)) {
    const std::string_view digits = text.substr(prefix.size());
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), count);
    const bool valid = error == std::errc() && end == digits.data() + digits.size() && digits[0] != '0';
    if (valid && count <= tracer::nearest_lights_max) return true;
  }
  count = 0;
  return add_issue(
      reading, at, "unknown_value",
      "must be \"nearest-1\" to \"nearest-" + std::to_string(tracer::nearest_lights_max) + "\", got " + quoted(text));
}

void read_approximations(Reading& reading, const Cursor& at, Approximations& approximate) {
  Fields fields(reading, at, "the approximations");
  fields.optional("shadows", approximate.shadows);
  fields.optional("reflections", approximate.reflections);
  fields.optional("shading", approximate.shading);
  fields.optional("interreflection", approximate.interreflection);
  if (const auto lights = fields.take("lights")) read_nearest_lights(reading, *lights, approximate.nearest_lights);
  fields.finish();
}

RequestedAccuracy read_requested(Reading& reading, const Cursor& at) {
  RequestedAccuracy requested;
  Accuracy& accuracy = reading.scene().accuracy;
  Fields fields(reading, at, "the accuracy");
  fields.optional("model", accuracy.model);
  if (Preset preset{}; fields.optional("preset", preset)) requested.preset = preset;
  fields.optional("target_error", requested.target_error);
  fields.optional("tile_error", requested.tile_error);
  if (const auto samples = fields.take("samples")) read_samples(reading, *samples, requested.samples);
  if (const auto budget = fields.take("time_budget_ms")) read_time_budget(reading, *budget, requested);
  requested.max_depth = fields.has("max_depth");
  fields.optional("max_depth", accuracy.max_depth);
  requested.cutoff = fields.has("cutoff");
  fields.optional("cutoff", accuracy.cutoff);
  fields.optional("seed", Integer<std::uint64_t>{accuracy.seed});
  fields.optional("proof", accuracy.proof);
  if (const auto approximate = fields.take("approximate"))
    read_approximations(reading, *approximate, accuracy.approximate);
  fields.finish();
  return requested;
}

/// The target error of the image by number, else by preset; "standard" if nothing else ends the sampling.
std::optional<double> target_of(const RequestedAccuracy& requested) {
  if (requested.target_error) return requested.target_error;
  if (requested.preset) return target_error_of(*requested.preset);
  if (requested.exact() || requested.time_budget_ms || requested.tile_error) return std::nullopt;
  return target_error_of(Preset::standard);
}

}  // namespace

void read_accuracy(Reading& reading, const std::optional<Cursor>& at) {
  const RequestedAccuracy requested = at ? read_requested(reading, *at) : RequestedAccuracy();
  Accuracy& accuracy = reading.scene().accuracy;
  const std::optional<double> target = target_of(requested);
  if (requested.exact()) {
    accuracy.samples = requested.samples.front();
    accuracy.target_error = target;
    accuracy.tile_error = requested.tile_error;
  } else {
    tracer::Adaptive& adaptive = accuracy.adaptive.emplace();
    adaptive.target_error = target;
    adaptive.tile_error = requested.tile_error;
    adaptive.time_budget_ms = requested.time_budget_ms;
    adaptive.samples_min = requested.samples.front();
    adaptive.samples_max = requested.samples.back();
    if (adaptive.samples_min <= adaptive.samples_max)
      adaptive.samples_max =
          tracer::bounded_samples(adaptive.samples_max, adaptive.samples_min, reading.scene().image.window().pixels());
  }
  accuracy.cutoff_by_chance = !requested.cutoff && accuracy.adaptive.has_value();
  if (!requested.max_depth)
    accuracy.max_depth = tracer::default_max_depth(accuracy.adaptive.has_value(), accuracy.cutoff);
}

}  // namespace api
