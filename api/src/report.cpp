#include "api/report.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <type_traits>
#include <utility>

#include "api/estimate.h"
#include "api/reader/json_parser.h"
#include "api/src/result_json.h"
#include "tracer/encode.h"
#include "tracer/version.h"
#include "tracer/warnings.h"

namespace api {
namespace {

/// {"requirements": {NAME: true|false, ...}, "reasons": {NAME: pointer, ...}}. A reason is the JSON pointer of the
/// first part of the document that has the requirement. Precondition: tracer::validate accepts `scene`.
Json requirements_json(const tracer::Scene& scene) {
  std::vector<tracer::RequirementReason> found;
  const tracer::Requirements needs = tracer::requirements(scene, &found);
  Json::object_t requirements, reasons;
  requirements.reserve(std::size(tracer::requirement_names));
  for (const auto& [name, needed] : tracer::requirement_names) {
    requirements.emplace_back(name, needs.*needed);
    for (const tracer::RequirementReason& reason : found)
      if (reason.needed == needed) reasons.emplace_back(name, reason.pointer);
  }
  Json json;
  json["requirements"] = std::move(requirements);
  json["reasons"] = std::move(reasons);
  return json;
}

/// Samples per pixel of the image, without holdout samples.
Json samples_json(const tracer::Scene& scene, const tracer::RenderStatistics& statistics) {
  const auto pixels = static_cast<double>(scene.image.window().pixels());
  return object_of({{"min", statistics.samples_min},
                    {"mean", static_cast<double>(statistics.samples - statistics.holdout_samples) / pixels},
                    {"max", statistics.samples_max}});
}

Json artifacts_json(const std::vector<ReportedArtifact>& artifacts) {
  return array_of(artifacts, [](const ReportedArtifact& artifact) {
    const tracer::FileError& error = artifact.error;
    return object_of({{"name", artifact.name},
                      {"error", object_of({{"estimate", error.estimate},
                                           {"proven", finite_or_null(error.proven)},
                                           {"met", error.target_met},
                                           {"worst_tile", error.worst_tile},
                                           {"encoding", error.encoding}})}});
  });
}

/// Upper bound of the radiance that culled shadow rays omit, as a mean over all samples.
double culled_radiance(const tracer::Scene& scene, const tracer::RenderStatistics& statistics) {
  if (statistics.samples == 0) return 0;
  return static_cast<double>(statistics.culled_radiance) * 0x1p-20 * scene.accuracy.cutoff.value_or(0) /
         static_cast<double>(statistics.samples);
}

/// Rounded to milliseconds.
Json seconds_json(const tracer::Scene& scene, std::optional<double> seconds_per_work) {
  std::optional<double> seconds;
  if (const auto work = estimated_work(scene); work && seconds_per_work) seconds = *work * *seconds_per_work;
  const tracer::Accuracy& accuracy = scene.accuracy;
  if (accuracy.adaptive && accuracy.adaptive->time_budget_ms) {
    const double budget = *accuracy.adaptive->time_budget_ms / 1000;
    seconds = std::min(seconds.value_or(budget), budget);
  }
  if (seconds) seconds = std::round(*seconds * 1000) / 1000;
  return or_null(seconds);
}

Json radiosity_json(const std::optional<tracer::RadiosityFigures>& figures, bool reused) {
  if (!figures) return nullptr;
  return object_of({{"patches", figures->patches},
                    {"limited", figures->limited},
                    {"stages", figures->stages},
                    {"rays", figures->rays},
                    {"factors", figures->factors},
                    {"sweeps", figures->sweeps},
                    {"reused", reused},
                    {"bound", finite_or_null(figures->bound)}});
}

}  // namespace

std::string write_report(const tracer::Scene& scene, const tracer::ErrorEstimate& error,
                         const std::vector<ReportedArtifact>& artifacts, const tracer::RenderStatistics& statistics,
                         const StageTimes& times, std::uint64_t memory_bytes, const Division& division,
                         const std::vector<std::string>& omitted) {
  std::vector<tracer::Issue> warnings = tracer::warnings(scene);
  for (std::size_t i = 0; i < omitted.size() && warnings.size() < tracer::warnings_max; ++i)
    warnings.push_back({"/model", "not_carried_over", omitted[i]});
  Json needs = requirements_json(scene);
  return object_of(
             {{"requirements", std::move(needs["requirements"])},
              {"reasons", std::move(needs["reasons"])},
              {"warnings", issues_json(warnings)},
              {"error", error_json(error)},
              {"artifacts", artifacts_json(artifacts)},
              {"samples", samples_json(scene, statistics)},
              {"holdout_samples", statistics.holdout_samples},
              {"rays", rays_json(statistics.rays)},
              {"culled_shadows",
               object_of({{"rays", statistics.culled_shadow_rays}, {"radiance", culled_radiance(scene, statistics)}})},
              {"duplicates", statistics.duplicates},
              {"time_ms", object_of({{"queue", times.queue},
                                     {"parse", times.parse},
                                     {"build", times.build},
                                     {"trace", times.trace},
                                     {"encode", times.encode}})},
              {"workers", division.workers},
              {"tasks", division.tasks},
              {"repeated_tasks", division.repeated_tasks},
              {"geometry_reused", times.cache_hits.geometry},
              {"textures",
               object_of({{"reused", times.cache_hits.textures}, {"decoded", times.cache_hits.decoded_textures}})},
              {"radiosity", radiosity_json(times.radiosity, times.cache_hits.radiosity)},
              {"estimated_work", or_null(estimated_work(scene))},
              {"memory_bytes", memory_bytes},
              {"non_finite", statistics.non_finite},
              {"build", tracer::build()}})
      .dump();
}

std::string write_accuracy(const tracer::Accuracy& accuracy) { return accuracy_json(accuracy).dump(); }

std::optional<ReportFigures> read_report(std::string_view report) {
  if (report.size() > report_bytes_max) return std::nullopt;
  auto tape = json::parse(report, {.bytes = report_bytes_max, .depth = 16, .values = 100'000, .key_bytes = 1024});
  if (!tape || tape->root()->kind != json::Kind::object) return std::nullopt;
  const auto member = [&](json::Node* object, const char* name) {
    json::Node* const key = object != nullptr ? tape->find_key(object, name) : nullptr;
    return key != nullptr ? key + 1 : nullptr;
  };
  const auto is_true = [](const json::Node* node) {
    return node != nullptr && node->kind == json::Kind::boolean && node->truth;
  };
  json::Node* const root = tape->root();
  json::Node* const error = member(root, "error");
  const auto number = [&](const char* outer, const char* inner) {
    const json::Node* const node = member(member(root, outer), inner);
    return node != nullptr && node->kind == json::Kind::number ? node->number : 0.0;
  };
  const auto count = [&](const char* outer, const char* inner) {
    return static_cast<std::uint64_t>(std::clamp(number(outer, inner), 0.0, 0x1p63));
  };
  ReportFigures figures;
  figures.of_render = member(root, "rays") != nullptr && error != nullptr;
  if (!figures.of_render) return figures;
  for (const auto& [name, rays] : tracer::ray_kinds) figures.rays.*rays = count("rays", name);
  figures.cache_hits.geometry = is_true(member(root, "geometry_reused"));
  figures.cache_hits.textures = static_cast<std::uint32_t>(count("textures", "reused"));
  figures.cache_hits.decoded_textures = static_cast<std::uint32_t>(count("textures", "decoded"));
  if (json::Node* const radiosity = member(root, "radiosity"); member(radiosity, "patches") != nullptr) {
    figures.cache_hits.radiosity = is_true(member(radiosity, "reused"));
    figures.radiosity = {.patches = static_cast<std::uint32_t>(count("radiosity", "patches")),
                         .rays = count("radiosity", "rays"),
                         .factors = count("radiosity", "factors"),
                         .sweeps = static_cast<std::uint32_t>(count("radiosity", "sweeps"))};
  }
  if (const double target = number("error", "target"); target > 0) {
    figures.target_met = is_true(member(error, "met"));
    figures.error_to_target = number("error", "estimate") / target;
  }
  return figures;
}

std::string uri_fragment(const std::string& pointer) {
  constexpr std::string_view allowed =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~!$&'()*+,;=:@/?";
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string fragment = "#";
  for (const char c : pointer) {
    if (allowed.find(c) != std::string_view::npos) {
      fragment += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    fragment += {'%', digits[byte >> 4], digits[byte & 15]};
  }
  return fragment;
}

Json issues_json(const std::vector<tracer::Issue>& issues) {
  return array_of(issues, [](const tracer::Issue& issue) {
    return object_of({{"pointer", uri_fragment(issue.pointer)}, {"code", issue.code}, {"detail", issue.detail}});
  });
}

std::string json_line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n'; }

std::string write_valid(const tracer::Scene& scene, std::optional<double> seconds_per_work) {
  const tracer::Accuracy& accuracy = scene.accuracy;
  const std::uint64_t samples = accuracy.adaptive ? accuracy.adaptive->samples_min : accuracy.samples;
  Json json =
      object_of({{"valid", true}, {"errors", Json::array()}, {"warnings", issues_json(tracer::warnings(scene))}});
  json.update(requirements_json(scene));
  json["global_light"] = tracer::global_light_summary(scene);
  json["estimate"] = object_of({{"samples", scene.image.window().pixels() * samples},
                                {"proof_rays", or_null(estimated_proof_rays(scene, content_of(scene)))},
                                {"seconds", seconds_json(scene, seconds_per_work)},
                                {"memory_bytes", estimated_memory_bytes(scene)}});
  return json_line(json);
}

std::string write_invalid(const std::vector<tracer::Issue>& errors) {
  return json_line(object_of({{"valid", false},
                              {"errors", issues_json(errors)},
                              {"warnings", Json::array()},
                              {"requirements", nullptr},
                              {"reasons", nullptr},
                              {"global_light", nullptr},
                              {"estimate", nullptr}}));
}

std::string with_format(const std::string& document, tracer::Format format) {
  Json json = Json::parse(std::string_view(document));
  Json& formats = json["output"]["formats"];
  // Without the field the default formats apply; they are kept.
  if (formats.is_null())
    for (const tracer::Format usual : tracer::Output{}.formats) formats.push_back(tracer::name(usual));
  formats.push_back(tracer::name(format));
  return json.dump();
}

// ---- live forms

namespace {

static_assert(std::endian::native == std::endian::little);

// The fields of a part of the scene, as the document has them.
Json field_json(double value) { return value; }
Json field_json(const tracer::Vec3& v) { return Json::array({v.x, v.y, v.z}); }
Json field_json(const tracer::Color& c) { return Json::array({c.r, c.g, c.b}); }
template <class Value>
Json field_json(const Value& value) {
  Json json = nullptr;
  if constexpr (requires { *value; }) {
    if (value) json = field_json(*value);
  } else if constexpr (std::is_enum_v<Value>) {
    for (const auto& [word, meaning] : tracer::words<Value>)
      if (value == meaning) json = std::string(word);
  } else {
    tracer::for_each_field<Value>(
        [&](const auto& field) { json[std::string(field.name)] = field_json(value.*field.member); });
  }
  return json;
}

/// Appends the values to the body; returns their entry in the header.
template <class Value>
Json add_table(const char* name, const std::vector<Value>& values, std::uint64_t columns, std::string& body) {
  const char* const type = std::is_same_v<Value, float> ? "float32" : "uint32";
  Json entry{{"name", name}, {"type", type}, {"columns", columns}, {"rows", values.size() / columns}};
  entry["offset"] = body.size();
  body.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value));
  return entry;
}

}  // namespace

std::string write_live(const tracer::Scene& scene, const tracer::LiveScene& live,
                       const std::vector<tracer::LiveOmission>& omitted) {
  std::string body;
  Json tables =
      array_of(tracer::live_tables, [&](const auto& each) { return add_table(each.name, live.*each.table, 4, body); });
  tables.push_back(add_table("texels", live.texels, 2, body));
  Json all = Json::array(), needs = Json::array();
  for (const auto& [name, needed] : tracer::requirement_names)
    if (live.needs.*needed) needs.push_back(std::string(name));
  for (const auto* list : {&omitted, &live.omitted})
    for (const auto& [pointer, detail] : *list) all.push_back({{"pointer", pointer}, {"detail", detail}});
  Json fields;
  for (const auto& [name, place] : live.material_fields) fields[std::string(name)] = place;
  const tracer::Accuracy& accuracy = scene.accuracy;
  const tracer::Output& output = scene.output;
  const Json depth = accuracy.max_depth ? Json(*accuracy.max_depth) : Json(nullptr);
  std::string text = json_line(object_of(
      {{"origin", field_json(live.origin)},
       {"scale", live.scale},
       {"image", {{"width", scene.image.width}, {"height", scene.image.height}}},
       {"camera", field_json(scene.camera)},
       {"ambient", field_json(scene.ambient)},
       {"medium", field_json(scene.medium)},
       {"depth_cue", field_json(scene.depth_cue)},
       {"output", {{"exposure", output.exposure}, {"overflow", field_json(output.overflow)}, {"alpha", output.alpha}}},
       {"accuracy", {{"max_depth", depth}, {"cutoff", field_json(accuracy.cutoff)}, {"seed", accuracy.seed}}},
       {"requirements", std::move(needs)},
       {"object_cells", live.object_cells},
       {"material_cells", live.material_cells},
       {"material_fields", std::move(fields)},
       {"materials", array_of(scene.materials, [](const auto& material) { return Json(material.path); })},
       {"omitted", std::move(all)},
       {"tables", std::move(tables)}}));
  while (text.size() % 4 != 0) text += ' ';
  const std::uint32_t prefix[] = {0x4556494cU, static_cast<std::uint32_t>(text.size())};
  std::string message(reinterpret_cast<const char*>(prefix), sizeof prefix);
  message.reserve(sizeof prefix + text.size() + body.size());
  return message.append(text).append(body);
}

}  // namespace api
