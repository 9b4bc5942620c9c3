/// Requested accuracy: the fields of the section, then the settings that result from them together.

#include <array>
#include <charconv>
#include <string>

#include "api/reader/fields.h"
#include "api/reader/issue_text.h"
#include "api/src/reader/sections.h"

namespace api {

using tracer::Accuracy;
using tracer::Approximations;
using tracer::Preset;

namespace {

/// A number of samples, or the least and the most.
struct SampleRange {
  std::uint32_t least = tracer::Adaptive{}.samples_min, most = tracer::Adaptive{}.samples_max;
};

/// The fields that determine the kind of sampling, as written.
struct RequestedAccuracy {
  Accuracy::Model model = Accuracy::Model::whitted;
  std::optional<Preset> preset;
  std::optional<double> target_error, tile_error, time_budget_ms;
  SampleRange samples;

  [[nodiscard]] bool exact() const { return samples.least == samples.most; }

  static constexpr auto fields() {
    return std::tuple{tracer::optional_field("model", &RequestedAccuracy::model),
                      tracer::Field{"preset", &RequestedAccuracy::preset},
                      tracer::Field{"target_error", &RequestedAccuracy::target_error},
                      tracer::Field{"tile_error", &RequestedAccuracy::tile_error},
                      tracer::Field{"time_budget_ms", &RequestedAccuracy::time_budget_ms},
                      tracer::optional_field("samples", &RequestedAccuracy::samples)};
  }
};

/// "nearest-8".
bool read_nearest_lights(Reading& reading, const Cursor& at, std::uint32_t& count) {
  constexpr std::string_view prefix = "nearest-";
  if (!expect_string(reading, at)) return false;
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

bool read(Reading& reading, const Cursor& at, SampleRange& samples) {
  const bool is_number = at.node->kind == json::Kind::number;
  if (!is_number && !expect_length(reading, at, 2, "N or [MIN, MAX]")) return false;
  std::array<std::uint32_t, 2> range{};
  bool valid = true;
  const auto read_count = [&](const Cursor& count) {
    valid &= read(reading, count, Integer<std::uint32_t>{range[count.index], 1});
  };
  is_number ? read_count(at) : (void)for_each_element(reading, at, read_count);
  if (valid) samples = {range[0], is_number ? range[0] : range[1]};
  return valid;
}

RequestedAccuracy read_requested(Reading& reading, const Cursor& at) {
  RequestedAccuracy requested;
  Accuracy& accuracy = reading.scene().accuracy;
  Fields fields(reading, at, "the accuracy");
  read_all_fields(fields, requested);
  read_all_fields(fields, accuracy);
  // With exact samples the scene has no time budget that tracer::validate could check.
  if (requested.exact() && requested.time_budget_ms && *requested.time_budget_ms <= 0)
    fields.add_issue("time_budget_ms", "out_of_range", "must be > 0, got " + number_text(*requested.time_budget_ms));
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

bool read(Reading& reading, const Cursor& at, Approximations& approximate) {
  Fields fields(reading, at, "the approximations");
  read_all_fields(fields, approximate);
  if (const auto lights = fields.take("lights")) read_nearest_lights(reading, *lights, approximate.nearest_lights);
  fields.finish();
  return static_cast<bool>(fields);
}

void read_accuracy(Reading& reading, const std::optional<Cursor>& at) {
  const RequestedAccuracy requested = at ? read_requested(reading, *at) : RequestedAccuracy();
  Accuracy& accuracy = reading.scene().accuracy;
  const std::optional<double> target = target_of(requested);
  accuracy.model = requested.model;
  if (requested.exact()) {
    accuracy.samples = requested.samples.least;
    accuracy.target_error = target;
    accuracy.tile_error = requested.tile_error;
  } else {
    tracer::Adaptive& adaptive = accuracy.adaptive.emplace();
    adaptive.target_error = target;
    adaptive.tile_error = requested.tile_error;
    adaptive.time_budget_ms = requested.time_budget_ms;
    adaptive.samples_min = requested.samples.least;
    adaptive.samples_max = requested.samples.most;
    if (adaptive.samples_min <= adaptive.samples_max)
      adaptive.samples_max =
          tracer::bounded_samples(adaptive.samples_max, adaptive.samples_min, reading.scene().image.window().pixels());
  }
}

}  // namespace api
