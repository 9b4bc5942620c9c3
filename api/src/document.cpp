#include "api/document.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>
#include <utility>
#include <vector>

#include "api/json.h"
#include "api/reader/fields.h"
#include "api/reader/issue_text.h"
#include "api/reader/request.h"
#include "api/src/reader/sections.h"
#include "tracer/sha256.h"

namespace api {
namespace {

/// A document of another version is not read further: its meaning is unknown.
bool read_version(Reading& reading, Fields& fields) {
  const auto field = fields.take_required("version", "1");
  double version = 0;
  if (field && field->node->kind != json::Kind::number) {
    add_wrong_type(reading, *field, "the number 1");
    return true;
  }
  if (!field || !read(reading, *field, version) || version == 1) return true;
  return add_issue(reading, *field, "out_of_range",
                   "must be 1, the version this build reads; got " + number_text(version));
}

constexpr std::string_view camera_form = R"({"position": [x, y, z], "look_at": [x, y, z]})";

/// Surfaces that glow light the scene under global light.
void check_visible_lights(Reading& reading) {
  if (reading.scene().accuracy.model != tracer::Accuracy::Model::global) return;
  for (const std::uint32_t light : reading.visible_lights)
    if (reading.can_add_issue())
      reading.issues.push_back({"/lights/" + std::to_string(light) + "/visible", "conflict",
                                "would light the scene twice where /accuracy/model is global: use an object whose "
                                "material has \"emission\""});
}

/// The model that the document stands for. Returns false if it stands for none.
bool read_model(Reading& reading, Fields& fields) {
  tracer::AssetId file;
  const bool is_valid = fields.optional("model", file);
  std::optional<double> time;
  if (double seconds = 0; fields.optional("time", seconds)) time = seconds;
  if (time && !fields.has("model")) fields.add_issue("time", "conflict", "needs \"model\"");
  if (is_valid) reading.document.model = {reading.scene().assets[file.index].name, time, {}};
  return fields.has("model");
}

/// Reads all sections. Returns false if the meaning of the document is unknown (no object, another version).
bool read_document(Reading& reading, const Cursor& at) {
  tracer::Scene& scene = reading.scene();
  Fields fields(reading, at, "the document");
  const auto section = [&](std::string_view name, void (*read_section)(Reading&, const Cursor&)) {
    if (const auto field = fields.take(name)) read_section(reading, *field);
  };
  if (!fields) return add_wrong_type(reading, at, "an object: {\"version\": 1, \"camera\": {...}, \"objects\": [...]}");
  if (!read_version(reading, fields)) return false;
  std::string schema;  // for editors
  fields.optional("$schema", schema);
  fields.optional("name", scene.name);
  fields.optional("image", scene.image);
  const bool has_model = read_model(reading, fields);
  const auto camera = has_model ? fields.take("camera") : fields.take_required("camera", camera_form);
  if (camera) read_camera(reading, *camera);
  if (has_model && !camera) scene.camera.look_at = {0, 0, -1};  // the model has one
  fields.optional("depth_cue", scene.depth_cue);
  fields.optional("medium", scene.medium);
  fields.optional("ambient", scene.ambient);
  section("lights", read_lights);
  section("textures", read_textures);
  section("background", read_background);
  section("materials", read_materials);
  section("prototypes", read_prototypes);
  section("objects", read_objects);
  fields.optional("output", scene.output);
  read_accuracy(reading, fields.take("accuracy"));  // depends on the image's size
  check_visible_lights(reading);
  reading.document.job.name = scene.name;
  fields.optional("job", reading.document.job);
  fields.finish();
  return true;
}

/// The reader's issues by pointer, to omit issues of `validate` that follow from them.
class ReportedIssues {
 public:
  explicit ReportedIssues(const std::vector<tracer::Issue>& issues) {
    for (const tracer::Issue& issue : issues) pointers_.push_back(issue.pointer);
    std::ranges::sort(pointers_);
  }

  /// True if the issue concerns a value with an issue, a part of one, or a value with such a part (except limits: a
  /// count is right whatever its elements). Unknown references are reported by the reader alone.
  [[nodiscard]] bool covers(const tracer::Issue& issue) const {
    return issue.code == "unknown_reference" || has_at_or_around(issue.pointer) ||
           (issue.code != "limit_exceeded" && has_inside(issue.pointer));
  }

 private:
  [[nodiscard]] bool has_at_or_around(std::string pointer) const {
    while (!std::ranges::binary_search(pointers_, pointer)) {
      if (pointer.empty()) return false;
      pointer.resize(pointer.rfind('/'));
    }
    return true;
  }

  [[nodiscard]] bool has_inside(const std::string& pointer) const {
    const std::string inside = pointer + "/";
    const auto first = std::ranges::lower_bound(pointers_, inside);
    return first != pointers_.end() && first->starts_with(inside);
  }

  std::vector<std::string> pointers_;
};

/// Adds the issues of tracer::validate that do not follow from the reader's.
std::vector<tracer::Issue> validated(Reading& reading) {
  const ReportedIssues reported(reading.issues);
  std::vector<tracer::Issue> found = tracer::validate(
      reading.scene(), reading.limits.scene, [&](const tracer::Issue& issue) { return reported.covers(issue); });
  std::vector<tracer::Issue> rest;
  if (!found.empty() && found.back().code == "too_many_issues") {
    rest.push_back(std::move(found.back()));
    found.pop_back();
  }
  std::move(found.begin(), found.end(), std::back_inserter(reading.issues));
  return rest;
}

// Canonical JSON text: equal for all spellings of the same value. As in RFC 8785, except that names are ordered by
// their bytes and that -0.0 is kept. Both members of a duplicate name are written, in their order. Recursion is as deep
// as the value, which DocumentLimits::depth bounds.

void append_string(std::string& text, std::string_view value) {
  const auto is_escaped = [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '"' || c == '\\'; };
  if (std::ranges::any_of(value, is_escaped)) {
    text += Json(value).dump();
  } else {
    text.append("\"").append(value).append("\"");
  }
}

void append_value(std::string& text, json::Tape& tape, json::Node* node);

void append_array(std::string& text, json::Tape& tape, json::Node* node) {
  json::Node* element = node + 1;
  text += '[';
  for (std::uint32_t i = 0; i < node->size; ++i, element = tape.next(element)) {
    if (i > 0) text += ',';
    append_value(text, tape, element);
  }
  text += ']';
}

void append_object(std::string& text, json::Tape& tape, json::Node* node) {
  std::vector<json::Node*> keys;
  json::Node* key = node + 1;
  for (std::uint32_t i = 0; i < node->size; ++i, key = tape.next(key + 1)) keys.push_back(key);
  std::ranges::stable_sort(keys, {}, &json::Node::string);
  text += '{';
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (i > 0) text += ',';
    append_string(text, keys[i]->string());
    text += ':';
    append_value(text, tape, keys[i] + 1);
  }
  text += '}';
}

void append_value(std::string& text, json::Tape& tape, json::Node* node) {
  if (node->kind == json::Kind::null) text += "null";
  if (node->kind == json::Kind::boolean) text += node->truth ? "true" : "false";
  if (node->kind == json::Kind::number) {
    std::array<char, 32> digits{};
    text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), node->number).ptr);
  }
  if (node->kind == json::Kind::string) append_string(text, node->string());
  if (node->kind == json::Kind::array) append_array(text, tape, node);
  if (node->kind == json::Kind::object) append_object(text, tape, node);
}

/// Precondition: `root` is an object.
Digests digests_of(json::Tape& tape, json::Node* root) {
  Digests digests;
  std::string text;
  json::Node* key = root + 1;
  for (std::uint32_t i = 0; i < root->size; ++i, key = tape.next(key + 1)) {
    if (key->string() == "job" || key->string() == "$schema") continue;
    text.clear();
    append_value(text, tape, key + 1);
    digests.emplace(key->string(), tracer::sha256_hex(text));
  }
  return digests;
}

}  // namespace

tracer::Result<Document, std::vector<tracer::Issue>> read_scene(json::Tape& tape, json::Node* root,
                                                                const Limits& limits) {
  Reading reading(tape, limits);
  reading.root.node = root;
  const bool understood = read_document(reading, reading.root);
  std::vector<tracer::Issue> rest;
  if (understood && reading.omitted_issues == 0) rest = validated(reading);
  std::vector<tracer::Issue> issues = reading.take_issues();
  std::move(rest.begin(), rest.end(), std::back_inserter(issues));
  if (!issues.empty()) return issues;
  add_visible_lights(reading);
  if (reading.document.model) append_value(reading.document.model->members, tape, root);
  return std::move(reading.document);
}

tracer::Result<Document, Refusal> parse_scene(std::string_view bytes, const Limits& limits, Digests* digests,
                                              DigestsOf wanted) {
  return read_request<Document>(bytes, limits.document, [&](json::Tape& tape, Document& document) {
    auto read = read_scene(tape, tape.root(), limits);
    if (!read) return std::move(read.error());
    document = std::move(*read);
    if (digests != nullptr && (wanted == DigestsOf::all_scenes || document.scene.accuracy.uses_patches()))
      *digests = digests_of(tape, tape.root());
    return std::vector<tracer::Issue>();
  });
}

}  // namespace api
