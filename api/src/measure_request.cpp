#include "api/measure_request.h"

#include <algorithm>
#include <iterator>
#include <new>
#include <utility>

#include "api/src/json/parse_error.h"
#include "api/src/reader/fields.h"
#include "api/src/reader/issue_order.h"
#include "api/src/reader/scene_document.h"
#include "tracer/measure.h"
#include "tracer/measurement.h"
#include "tracer/reference.h"

namespace api {
namespace {

constexpr const char* reference_pointer = "/settings/reference_samples";

void read_parameters(Reading& reading, const Cursor& at, std::vector<std::string>& parameters) {
  const bool is_list = for_each_element(reading, at, [&](const Cursor& element) {
    const bool is_text = element.node->kind == json::Kind::string;
    const auto known =
        is_text ? std::find(std::begin(tracer::parameters), std::end(tracer::parameters), element.node->string())
                : std::end(tracer::parameters);
    if (known == std::end(tracer::parameters))
      return add_unknown_word(reading, element, "settings.parameters", tracer::parameters);
    if (std::find(parameters.begin(), parameters.end(), *known) != parameters.end()) {
      return add_issue(reading, element, "duplicate_value", quoted(*known) + " is there already");
    }
    parameters.emplace_back(*known);
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

/// The request but for its scene, whose place it answers; null where there is none.
json::Node* read_request(Reading& reading, MeasureRequest& request) {
  Cursor root;
  root.node = reading.tape.root();
  Fields fields(reading, root, "a measurement");
  const auto scene = fields.take("scene");
  if (!scene && fields) fields.report_missing_field("scene");
  if (const auto settings = fields.take("settings")) read_settings(reading, *settings, request);
  fields.finish();
  return scene ? scene->node : nullptr;
}

/// A reference too large for the limit that bounds every image.
std::vector<tracer::Issue> judge_reference(const MeasureRequest& request, const tracer::Limits& limits) {
  const std::uint64_t pixels = request.document.scene.image.window().pixels();
  const std::uint64_t samples = pixels * request.reference_samples;  // 2^26 x 10^6 at most
  if (samples <= limits.samples_times_pixels) return {};
  return {{reference_pointer, "limit_exceeded",
           "the limit samples_times_pixels is " + std::to_string(limits.samples_times_pixels) + ", the reference has " +
               std::to_string(samples)}};
}

tracer::Result<MeasureRequest, Refusal> read(std::string_view bytes, const Limits& limits) {
  auto tape = parse_json(bytes, limits.document);
  if (!tape) return std::move(tape.error());
  MeasureRequest request;
  request.reference_samples = tracer::MeasureSettings().reference_samples;
  Reading reading(*tape, limits);
  json::Node* const scene = read_request(reading, request);
  std::vector<tracer::Issue> issues = std::move(reading.issues);
  sort_by_position(issues, *tape);
  if (reading.omitted_issues > 0) {
    issues.push_back({"", "too_many_issues", "and " + std::to_string(reading.omitted_issues) + " more"});
  }
  if (scene != nullptr) {
    auto document = read_scene(*tape, scene, limits);
    if (document) {
      request.document = std::move(*document);
      if (issues.empty()) issues = judge_reference(request, limits.scene);
    } else {
      for (tracer::Issue& issue : document.error()) {
        issue.pointer.insert(0, "/scene");
        issues.push_back(std::move(issue));
      }
    }
  }
  if (!issues.empty()) return invalid(std::move(issues));
  return request;
}

}  // namespace

tracer::Result<MeasureRequest, Refusal> parse_measure(std::string_view bytes, const Limits& limits) {
  try {
    return read(bytes, limits);
  } catch (const std::bad_alloc&) {
    return too_large("reading the request takes more memory than there is");
  }
}

}  // namespace api
