#include "api/requests.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "api/src/reader/fields.h"
#include "api/src/reader/issue_text.h"
#include "api/src/reader/request.h"
#include "api/src/reader/sections.h"
#include "tracer/measure.h"
#include "tracer/measurement.h"
#include "tracer/sha256.h"

namespace api {

constexpr auto words_of(BulkRequest::Action first) {
  return tracer::in_order(first, {"cancel", "retry", "remove", "priority"});
}

namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> read_hashes(Reading& reading, const Cursor& at) {
  std::vector<std::string> hashes;
  std::set<std::string_view> known;
  if (!within_limit(reading, at, "asset_hashes_max", asset_hashes_max)) return hashes;
  for_each_element(reading, at, [&](const Cursor& element) {
    if (element.node->kind != json::Kind::string) return add_wrong_type(reading, element, "a sha256 as text");
    const std::string_view hash = element.node->string();
    if (!tracer::is_sha256(hash))
      return add_issue(reading, element, "malformed", "must be 64 lower-case hex digits, got " + quoted(hash));
    if (known.insert(hash).second) hashes.emplace_back(hash);
    return true;
  });
  return hashes;
}

void read_ids(Reading& reading, const Cursor& at, std::vector<std::string>& ids) {
  std::set<std::string_view> known;
  if (!within_limit(reading, at, "bulk_jobs", bulk_jobs_max)) return;
  const bool is_list = for_each_element(reading, at, [&](const Cursor& element) {
    if (element.node->kind != json::Kind::string) return add_wrong_type(reading, element, "the id of a job");
    if (known.insert(element.node->string()).second) ids.emplace_back(element.node->string());
    return true;
  });
  if (is_list && at.node->size == 0) add_issue(reading, at, "wrong_length", "must name at least one job");
}

void read_filter(Reading& reading, const Cursor& at, std::vector<std::pair<std::string, std::string>>& filter) {
  const bool is_object = for_each_member(reading, at, [&](const Cursor& member) {
    const auto add = [&](const Cursor& value) {
      if (value.node->kind != json::Kind::string) return add_wrong_type(reading, value, "a string");
      filter.emplace_back(member.key, value.node->string());
      return true;
    };
    if (member.node->kind == json::Kind::array) {
      for_each_element(reading, member, add);
    } else {
      add(member);
    }
  });
  if (is_object && filter.empty())
    add_issue(reading, at, "wrong_length", "must have a condition: no action is on all jobs");
}

void read_bulk(Reading& reading, BulkRequest& request) {
  Fields fields(reading, reading.root, "a bulk request");
  fields.required("action", request.action);
  const bool sets_priority = request.action == BulkRequest::Action::priority;
  if (sets_priority) fields.required("value", Integer<int>{request.priority, 0, 100});
  const auto ids = fields.take("ids"), filter = fields.take("filter");
  if (ids) read_ids(reading, *ids, request.ids);
  if (filter) read_filter(reading, *filter, request.filter);
  if (!ids && !filter) fields.report_missing_one_of(std::array<std::string_view, 2>{"ids", "filter"});
  if (ids && filter) add_issue(reading, *filter, "conflict", "must not be given together with ids");
  fields.optional("dry_run", request.dry_run);
  fields.finish();
}

void read_compare(Reading& reading, CompareRequest& request) {
  Fields fields(reading, reading.root, "a comparison");
  fields.required("a", Name{request.a});
  fields.required("b", Name{request.b});
  if (const auto tolerance = fields.take("tolerance")) {
    double levels = 0;
    if (read(reading, *tolerance, levels) && levels < 0)
      add_issue(reading, *tolerance, "out_of_range", "must be >= 0, a root mean square error in levels");
    request.tolerance = levels;
  }
  fields.optional("heat", request.heat);
  fields.finish();
}

void read_parameters(Reading& reading, const Cursor& at, std::vector<std::string>& parameters) {
  const bool is_list = for_each_element(reading, at, [&](const Cursor& element) {
    const std::string_view name = element.node->kind == json::Kind::string ? element.node->string() : "";
    if (std::find(std::begin(tracer::parameters), std::end(tracer::parameters), name) == std::end(tracer::parameters)) {
      add_unknown_word(reading, element, tracer::parameters);
    } else if (std::find(parameters.begin(), parameters.end(), name) != parameters.end()) {
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

/// `read_root(reading, result)` reads the root of the document.
template <class T, class ReadRoot>
tracer::Result<T, Refusal> parse(std::string_view bytes, const Limits& limits, const ReadRoot& read_root) {
  return read_request<T>(bytes, limits.document, [&](json::Tape& tape, T& result) {
    Reading reading(tape, limits);
    read_root(reading, result);
    return reading.take_issues();
  });
}

}  // namespace

tracer::Result<std::vector<std::string>, Refusal> parse_asset_hashes(std::string_view bytes, const Limits& limits) {
  return parse<std::vector<std::string>>(bytes, limits, [](Reading& reading, std::vector<std::string>& hashes) {
    Fields fields(reading, reading.root, "the request");
    if (const auto list = fields.take_required("sha256")) hashes = read_hashes(reading, *list);
    fields.finish();
  });
}

std::string write_missing(const std::vector<std::string>& hashes) { return Json{{"missing", hashes}}.dump() + '\n'; }

std::string write_asset(const std::string& sha256, std::uint64_t bytes) {
  return Json{{"sha256", sha256}, {"bytes", bytes}}.dump() + '\n';
}

tracer::Result<std::string, Refusal> parse_ticket(std::string_view bytes, const Limits& limits) {
  return parse<std::string>(bytes, limits, [](Reading& reading, std::string& path) {
    Fields fields(reading, reading.root, "the request");
    if (const auto at = fields.take_required("path"); at && read(reading, *at, Name{path})) {
      const bool is_plain =
          std::all_of(path.begin(), path.end(), [](char c) { return c > ' ' && c <= '~' && c != '#'; });
      if (!is_plain || !path.starts_with("/v1/")) add_issue(reading, *at, "malformed", "must be a path below /v1/");
    }
    fields.finish();
  });
}

tracer::Result<RequestedChange, Refusal> parse_change(std::string_view bytes, const Limits& limits) {
  return parse<RequestedChange>(bytes, limits, [](Reading& reading, RequestedChange& change) {
    Fields fields(reading, reading.root, "a change of a job");
    fields.optional("priority", Integer<std::optional<int>>{change.priority, 0, 100});
    if (std::string name; fields.optional("name", Name{name})) change.name = name;
    if (const auto labels = fields.take("labels")) read_labels(reading, *labels, true, change.labels);
    if (const auto expires_at = fields.take("expires_at")) {
      std::optional<std::int64_t> time;
      const bool never = expires_at->node->kind == json::Kind::null;
      if (never || read(reading, *expires_at, Time{time})) change.expires_at = time;
    }
    fields.finish();
  });
}

tracer::Result<BulkRequest, Refusal> parse_bulk(std::string_view bytes, const Limits& limits) {
  return parse<BulkRequest>(bytes, limits, read_bulk);
}

tracer::Result<CompareRequest, Refusal> parse_compare(std::string_view bytes, const Limits& limits) {
  return parse<CompareRequest>(bytes, limits, read_compare);
}

tracer::Result<Webhook, Refusal> parse_webhook(std::string_view bytes, const Limits& limits) {
  return parse<Webhook>(bytes, limits,
                        [](Reading& reading, Webhook& webhook) { read_webhook(reading, reading.root, webhook); });
}

tracer::Result<MeasureRequest, Refusal> parse_measure(std::string_view bytes, const Limits& limits) {
  return read_request<MeasureRequest>(
      bytes, limits.document, [&](json::Tape& tape, MeasureRequest& request) { return read(tape, limits, request); });
}

}  // namespace api
