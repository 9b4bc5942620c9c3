#include "api/batch.h"

#include <new>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/issue_text.h"
#include "api/src/reader/request.h"

namespace api {
namespace {

using Json = nlohmann::ordered_json;
using Pointer = Json::json_pointer;

/// One pointer of a sweep and its values.
struct Axis {
  std::string text;
  Pointer pointer;
  std::vector<Json> values;
};

/// Parses the documents of a batch one by one. read_shape() has limited the depth of the body.
class Documents {
 public:
  Documents(const BatchLimits& limits, const TakeDocument& take) : limits_(limits), take_(take) {}

  /// `place` is the prefix of the issues' pointers, `suffix` ends their messages.
  void add(const Json& document, const std::string& place, const std::string& suffix) {
    std::string text = document.dump();
    bytes_ += text.size();
    if (bytes_ > limits_.all_bytes)
      return add_issue(
          {place, "limit_exceeded",
           "the limit batch_bytes is " + std::to_string(limits_.all_bytes) + " for all documents together"});
    std::string canonical;
    auto parsed = parse_scene(text, limits_.document, &canonical);
    if (parsed && issues_.empty()) return take_(std::move(text), std::move(*parsed), std::move(canonical));
    if (parsed) return;
    if (parsed.error().kind != Refusal::Kind::invalid)
      add_issue({place, "limit_exceeded", parsed.error().detail + suffix});
    for (tracer::Issue& issue : parsed.error().issues)
      add_issue({place + issue.pointer, std::move(issue.code), issue.detail + suffix});
  }
  void add_issue(tracer::Issue issue) {
    if (issues_.size() < issues_max) issues_.push_back(std::move(issue));
  }
  [[nodiscard]] bool full() const { return issues_.size() >= issues_max || bytes_ > limits_.all_bytes; }
  std::vector<tracer::Issue> take_issues() { return std::move(issues_); }

 private:
  static constexpr int issues_max = 100;  // the documents are alike: more issues would repeat the same
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

/// True if the value that is to contain the place of `pointer` exists.
bool has_parent(const Json& scene, const Pointer& pointer) {
  if (pointer.empty() || !scene.contains(pointer.parent_pointer())) return false;
  const Json& parent = scene.at(pointer.parent_pointer());
  return parent.is_object() || (parent.is_array() && scene.contains(pointer));
}

/// Returns fewer axes than the sweep has, with issues, if some are invalid.
std::vector<Axis> read_axes(const Json& scene, const Json& sweep, Documents& documents) {
  std::vector<Axis> axes;
  for (const auto& [text, values] : sweep.items()) {
    const std::string place = "/sweep/" + nlohmann::detail::escape(text);
    try {
      const Pointer pointer(text);
      if (has_parent(scene, pointer)) {
        axes.push_back({text, pointer, values.get<std::vector<Json>>()});
      } else {
        documents.add_issue(
            {place, "unknown_reference", "the scene has no object or array that can contain " + api::quoted(text)});
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
    std::string values;
    std::size_t rest = combination;
    for (std::size_t i = axes.size(); i-- > 0;) {
      const Axis& axis = axes[i];
      const Json& value = axis.values[rest % axis.values.size()];
      rest /= axis.values.size();
      document[axis.pointer] = value;
      values.insert(0, axis.text + " = " + value.dump() + (values.empty() ? "" : ", "));
    }
    documents.add(document, "/scene", " (with " + values + ")");
  }
}

/// The body without its documents, and their number.
struct Shape {
  BatchRequest request;
  bool frames = false;
  std::size_t count = 0;
};

std::size_t count_combinations(Reading& reading, const Cursor& at, std::size_t most) {
  std::size_t count = 1;
  const bool is_map = for_each_member(reading, at, [&](const Cursor& member) {
    if (member.node->kind != json::Kind::array) return add_wrong_type(reading, member, "an array");
    if (member.node->size == 0) return add_issue(reading, member, "wrong_length", "must have at least one value");
    count = count > most ? count : count * member.node->size;
    return true;
  });
  if (is_map && at.node->size == 0) add_issue(reading, at, "wrong_length", "must have at least one pointer");
  return count;
}

std::size_t count_frames(Reading& reading, const Cursor& at) {
  const bool is_list = for_each_element(reading, at, [&](const Cursor& frame) {
    if (frame.node->kind != json::Kind::object) add_wrong_type(reading, frame, "an object");
  });
  if (is_list && at.node->size == 0) add_issue(reading, at, "wrong_length", "must have at least one frame");
  return is_list ? at.node->size : 0;
}

void read_shape(Reading& reading, const BatchLimits& limits, Shape& shape) {
  Fields fields(reading, reading.root, "a batch");
  fields.optional("name", Name{shape.request.name});
  fields.optional("max_failed", Integer<std::optional<int>>{shape.request.max_failed, 0, limits.jobs});
  const auto scene = fields.take_required("scene");
  if (scene && scene->node->kind != json::Kind::object) add_wrong_type(reading, *scene, "an object");
  const auto most = static_cast<std::size_t>(limits.jobs);
  const auto frames = fields.take("frames"), sweep = fields.take("sweep");
  if (frames && sweep) add_issue(reading, *sweep, "conflict", "a batch has frames or a sweep, not both");
  if (!frames && !sweep) fields.report_missing_one_of(std::vector<std::string_view>{"frames", "sweep"});
  shape.frames = frames.has_value();
  if (frames) {
    shape.count = count_frames(reading, *frames);
  } else if (sweep) {
    shape.count = count_combinations(reading, *sweep, most);
  }
  if (shape.count > most)
    add_issue(reading, frames ? *frames : *sweep, "limit_exceeded",
              "the limit batch_jobs is " + std::to_string(most) + ", got " +
                  (frames ? std::to_string(shape.count) : "more combinations"));
  fields.finish();
}

std::vector<tracer::Issue> read_documents(std::string_view bytes, const Shape& shape, Documents& documents) {
  const Json body = Json::parse(bytes, nullptr, false);
  // read_shape() accepts such numbers as infinite; the library does not.
  if (body.is_discarded()) return {{"", "not_finite", "a number is too large for a double"}};
  const Json& scene = body.at("scene");
  if (shape.frames) {
    add_frames(scene, body.at("frames"), documents);
  } else {
    const std::vector<Axis> axes = read_axes(scene, body.at("sweep"), documents);
    if (axes.size() == body.at("sweep").size()) add_sweep(scene, axes, shape.count, documents);
  }
  return documents.take_issues();
}

}  // namespace

tracer::Result<BatchRequest, Refusal> parse_batch(std::string_view bytes, const BatchLimits& limits,
                                                  const TakeDocument& take) {
  // The tape is freed before the documents are made.
  auto shape = read_request<Shape>(bytes, limits.document.document, [&](json::Tape& tape, Shape& result) {
    Reading reading(tape, limits.document);
    read_shape(reading, limits, result);
    return reading.take_issues();
  });
  if (!shape) return std::move(shape.error());
  try {
    Documents documents(limits, take);
    std::vector<tracer::Issue> issues = read_documents(bytes, *shape, documents);
    if (!issues.empty()) return invalid(std::move(issues));
    shape->request.jobs = static_cast<int>(shape->count);
    return std::move(shape->request);
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  }
}

}  // namespace api
