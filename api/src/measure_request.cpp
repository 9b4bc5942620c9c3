#include "api/measure_request.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "api/reader/fields.h"
#include "api/reader/issue_text.h"
#include "api/reader/request.h"
#include "api/src/reader/sections.h"
#include "tracer/measure.h"
#include "tracer/measurement.h"

namespace api {
namespace {

void read_parameters(Reading& reading, const Cursor& at, std::vector<std::string>& parameters) {
  const bool is_list = for_each_element(reading, at, [&](const Cursor& element) {
    const std::string_view name = element.node->kind == json::Kind::string ? element.node->string() : "";
    if (std::ranges::find(tracer::parameters, name) == std::end(tracer::parameters)) {
      add_unknown_word(reading, element, tracer::parameters);
    } else if (std::ranges::find(parameters, name) != parameters.end()) {
      add_issue(reading, element, "duplicate_value", quoted(name) + " is written twice");
    } else {
      parameters.emplace_back(name);
    }
  });
  if (is_list && at.node->size == 0)
    add_issue(reading, at, "wrong_length", "must name at least one parameter; leave it out for all");
}

void read_settings(Reading& reading, const Cursor& at, MeasureRequest& request) {
  Fields fields(reading, at, "the settings");
  if (const auto parameters = fields.take("parameters")) read_parameters(reading, *parameters, request.parameters);
  fields.optional("reference_samples", Integer<std::uint32_t>{request.reference_samples, tracer::reference_samples_min,
                                                              measure_reference_samples_max});
  fields.finish();
}

/// Applies the limit of samples_times_pixels to the reference.
std::vector<tracer::Issue> validate_reference(const MeasureRequest& request, const tracer::Limits& limits) {
  const std::uint64_t pixels = request.document.scene.image.window().pixels();
  const std::uint64_t samples = pixels * request.reference_samples;  // 2^26 x 10^6 at most
  if (samples <= limits.samples_times_pixels) return {};
  return {{"/settings/reference_samples", "limit_exceeded",
           "the limit samples_times_pixels is " + std::to_string(limits.samples_times_pixels) + ", the reference has " +
               std::to_string(samples)}};
}

std::vector<tracer::Issue> read(json::Tape& tape, const Limits& limits, MeasureRequest& request) {
  request.reference_samples = tracer::MeasureSettings().reference_samples;
  Reading reading(tape, limits);
  Fields fields(reading, reading.root, "a measurement");
  const auto scene = fields.take_required("scene");
  if (const auto settings = fields.take("settings")) read_settings(reading, *settings, request);
  fields.finish();
  std::vector<tracer::Issue> issues = reading.take_issues();
  if (!scene) return issues;
  auto document = read_scene(tape, scene->node, limits);
  if (document) {
    request.document = std::move(*document);
    return issues.empty() ? validate_reference(request, limits.scene) : issues;
  }
  for (tracer::Issue& issue : document.error()) {
    issue.pointer.insert(0, "/scene");
    issues.push_back(std::move(issue));
  }
  return issues;
}

}  // namespace

tracer::Result<MeasureRequest, Refusal> parse_measure(std::string_view bytes, const Limits& limits) {
  return read_request<MeasureRequest>(
      bytes, limits.document, [&](json::Tape& tape, MeasureRequest& request) { return read(tape, limits, request); });
}

}  // namespace api
