#include "api/batch.h"

#include <new>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "api/src/json/parse_error.h"
#include "api/src/json/tape.h"
#include "api/src/reader/fields.h"
#include "api/src/reader/issue_order.h"

namespace api {
namespace {

using Json = nlohmann::ordered_json;
using Pointer = Json::json_pointer;

constexpr int issues_reported = 100;  // of documents that are alike: more would say the same

/// One pointer of a sweep and its values.
struct Axis {
  std::string text;
  Pointer pointer;
  std::vector<Json> values;
};

/// The documents of a batch, one after another. The body has passed the guard of src/json, so its depth is bounded.
class Documents {
 public:
  Documents(const BatchLimits& limits, const TakeDocument& take) : limits_(limits), take_(take) {}

  /// `place` is where issues are told, `said` what tells this document from others.
  void add(const Json& document, const std::string& place, const std::string& said) {
    std::string text = document.dump();
    bytes_ += text.size();
    if (bytes_ > limits_.all_bytes) return add_issue({place, "limit_exceeded", all_bytes_sentence()});
    std::string canonical;
    auto parsed = parse_scene(text, limits_.document, &canonical);
    if (parsed && issues_.empty()) return take_(std::move(text), std::move(*parsed), std::move(canonical));
    if (parsed) return;
    if (parsed.error().kind != Refusal::Kind::invalid)
      add_issue({place, "limit_exceeded", parsed.error().detail + said});
    for (tracer::Issue& issue : parsed.error().issues) {
      add_issue({place + issue.pointer, std::move(issue.code), issue.detail + said});
    }
  }
  void add_issue(tracer::Issue issue) {
    if (issues_.size() < issues_reported) issues_.push_back(std::move(issue));
  }
  [[nodiscard]] bool full() const { return issues_.size() >= issues_reported || bytes_ > limits_.all_bytes; }
  std::vector<tracer::Issue> take_issues() { return std::move(issues_); }

 private:
  [[nodiscard]] std::string all_bytes_sentence() const {
    return "the limit batch_bytes is " + std::to_string(limits_.all_bytes) + " for all documents together";
  }

  const BatchLimits& limits_;
  const TakeDocument& take_;
  std::size_t bytes_ = 0;
  std::vector<tracer::Issue> issues_;
};

void add_frames(const Json& scene, const Json& frames, Documents& documents) {
  for (std::size_t i = 0; i < frames.size() && !documents.full(); ++i) {
    Json document = scene;
    document.merge_patch(frames[i]);
    documents.add(document, "/frames/" + std::to_string(i), "");
  }
}

/// Whether there is something around the place that `pointer` names.
bool has_parent(const Json& scene, const Pointer& pointer) {
  if (pointer.empty() || !scene.contains(pointer.parent_pointer())) return false;
  const Json& parent = scene.at(pointer.parent_pointer());
  return parent.is_object() || (parent.is_array() && scene.contains(pointer));
}

std::vector<Axis> axes_of(const Json& scene, const Json& sweep, Documents& documents) {
  std::vector<Axis> axes;
  for (const auto& [text, values] : sweep.items()) {
    Axis axis;
    axis.text = text;
    axis.values = values.get<std::vector<Json>>();
    const std::string place = "/sweep/" + nlohmann::detail::escape(text);
    try {
      axis.pointer = Pointer(text);
      if (has_parent(scene, axis.pointer)) {
        axes.push_back(std::move(axis));
      } else {
        documents.add_issue({place, "unknown_reference", "the scene has nothing around " + api::quoted(text)});
      }
    } catch (const Json::exception&) {  // a pointer must begin with a slash, an index be a number
      documents.add_issue({place, "malformed", api::quoted(text) + " is no JSON pointer (RFC 6901) into the scene"});
    }
  }
  return axes;
}

void add_sweep(const Json& scene, const std::vector<Axis>& axes, std::size_t count, Documents& documents) {
  for (std::size_t combination = 0; combination < count && !documents.full(); ++combination) {
    Json document = scene;
    std::string said;
    std::size_t rest = combination;
    for (std::size_t i = axes.size(); i-- > 0;) {
      const Axis& axis = axes[i];
      const Json& value = axis.values[rest % axis.values.size()];
      rest /= axis.values.size();
      document[axis.pointer] = value;
      said.insert(0, axis.text + " = " + value.dump() + (said.empty() ? "" : ", "));
    }
    documents.add(document, "/scene", " (with " + said + ")");
  }
}

/// The shape of the body: its fields, and how many documents it means.
struct Shape {
  bool frames = false;
  std::size_t count = 0;
};

std::size_t combinations(Reading& reading, const Cursor& at, std::size_t most) {
  std::size_t count = 1;
  const bool is_map = for_each_member(reading, at, [&](const Cursor& member) {
    if (member.node->kind != json::Kind::array) return add_wrong_type(reading, member, "an array");
    if (member.node->size == 0) return add_issue(reading, member, "wrong_length", "must have at least one value");
    count = count > most ? count : count * member.node->size;
  });
  if (is_map && at.node->size == 0) add_issue(reading, at, "wrong_length", "must have at least one pointer");
  return count;
}

void read_shape(Reading& reading, const Cursor& at, const BatchLimits& limits, BatchRequest& request, Shape& shape) {
  Fields fields(reading, at, "a batch");
  fields.optional("name", Name{request.name});
  int max_failed = 0;
  if (fields.optional("max_failed", Integer<int>{max_failed, 0, limits.jobs})) request.max_failed = max_failed;
  const auto scene = fields.take("scene");
  if (!scene && fields) fields.report_missing_field("scene");
  if (scene && scene->node->kind != json::Kind::object) add_wrong_type(reading, *scene, "an object");
  const auto most = static_cast<std::size_t>(limits.jobs);
  const auto frames = fields.take("frames"), sweep = fields.take("sweep");
  if (frames && sweep) add_issue(reading, *sweep, "conflict", "a batch has frames or a sweep, not both");
  if (!frames && !sweep && fields) fields.report_missing_one_of(std::vector<std::string_view>{"frames", "sweep"});
  if (frames) {
    shape.frames = true;
    for_each_element(reading, *frames, [&](const Cursor& frame) {
      if (frame.node->kind != json::Kind::object) add_wrong_type(reading, frame, "an object");
    });
    shape.count = frames->node->kind == json::Kind::array ? frames->node->size : 0;
    if (frames->node->kind == json::Kind::array && shape.count == 0) {
      add_issue(reading, *frames, "wrong_length", "must have at least one frame");
    }
  } else if (sweep) {
    shape.count = combinations(reading, *sweep, most);
  }
  if (shape.count > most) {
    add_issue(reading, frames ? *frames : *sweep, "limit_exceeded",
              "the limit batch_jobs is " + std::to_string(most) + ", got " +
                  (frames ? std::to_string(shape.count) : "more combinations"));
  }
  fields.finish();
}

tracer::Result<BatchRequest, Refusal> read(std::string_view bytes, const BatchLimits& limits,
                                           const TakeDocument& take) {
  const DocumentLimits& of_body = limits.document.document;
  BatchRequest request;
  Shape shape;
  {
    auto tape = parse_json(bytes, of_body);
    if (!tape) return std::move(tape.error());
    Reading reading(*tape, limits.document);
    Cursor root;
    root.node = tape->root();
    read_shape(reading, root, limits, request, shape);
    if (!reading.issues.empty()) {
      sort_by_position(reading.issues, *tape);
      return invalid(std::move(reading.issues));
    }
  }
  // What the guard notes as infinite the library refuses: such a number has no place in a document that is varied.
  const Json body = Json::parse(bytes, nullptr, false);
  if (body.is_discarded()) return invalid({{"", "not_finite", "a number is too large for a double"}});
  Documents documents(limits, take);
  const Json& scene = body.at("scene");
  if (shape.frames) {
    add_frames(scene, body.at("frames"), documents);
  } else {
    const std::vector<Axis> axes = axes_of(scene, body.at("sweep"), documents);
    if (axes.size() == body.at("sweep").size()) add_sweep(scene, axes, shape.count, documents);
  }
  std::vector<tracer::Issue> issues = documents.take_issues();
  if (!issues.empty()) return invalid(std::move(issues));
  request.jobs = static_cast<int>(shape.count);
  return request;
}

}  // namespace

tracer::Result<BatchRequest, Refusal> parse_batch(std::string_view bytes, const BatchLimits& limits,
                                                  const TakeDocument& take) {
  try {
    return read(bytes, limits, take);
  } catch (const std::bad_alloc&) {
    return too_large("reading the documents takes more memory than there is");
  }
}

}  // namespace api
