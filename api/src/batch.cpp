#include "api/batch.h"

#include <algorithm>
#include <array>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "api/reader/fields.h"
#include "api/reader/issue_text.h"
#include "api/reader/request.h"

namespace api {
namespace {

using Json = nlohmann::ordered_json;
using Pointer = Json::json_pointer;

/// One pointer of a sweep and its values.
struct Axis {
  std::string text;
  std::string member;     ///< the member of the document that contains the place
  std::string operation;  ///< as in RFC 6902: "add" sets a member of an object, "replace" an element of an array
  std::vector<Json> values;
};

/// The difference of one document from the scene.
struct Variation {
  Json patch;                        ///< see apply_patch
  Json values;                       ///< values of a sweep, by pointer; else null
  std::vector<std::string> members;  ///< those of the document that the patch changes
  std::string place;                 ///< prefix of the pointers of issues
  std::string suffix;                ///< end of their messages
};

/// Members that are read for each document: small, and the estimates depend on them.
constexpr std::array<std::string_view, 7> small_members{"version", "name",     "image", "camera",
                                                        "output",  "accuracy", "job"};
/// Members that name each other, and so are read together.
constexpr std::array<std::string_view, 5> content_members{"textures", "materials", "prototypes", "objects",
                                                          "background"};

template <std::size_t size>
bool contains(const std::array<std::string_view, size>& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

/// False if the patch does not apply. Of JSON patches only the operations of Axis are known.
bool patch_document(Json& document, const Json& patch) {
  if (!patch.is_array()) {
    document.merge_patch(patch);
    return true;
  }
  try {
    for (const Json& operation : patch) {
      const Pointer path(operation.at("path").get<std::string>());
      Json& parent = document.at(path.parent_pointer());
      if (!parent.is_structured()) return false;
      (parent.is_object() ? parent[path.back()] : document.at(path)) = operation.at("value");
    }
    return true;
  } catch (const Json::exception&) {
    return false;
  }
}

/// Values with keys. Recursion is bounded by DocumentLimits::depth.
std::size_t count_values(const Json& value) {
  std::size_t count = value.is_object() ? 1 + value.size() : 1;
  if (value.is_structured())
    for (const Json& part : value) count += count_values(part);
  return count;
}

/// Reads the documents of a batch one by one. read_shape() has limited the depth of the body.
class Documents {
 public:
  Documents(const Json& scene, const BatchLimits& limits, const TakeFrame& take)
      : scene_(scene), limits_(limits), take_(take), bytes_(scene.dump().size()) {
    for (const auto& [name, value] : scene.items())
      if (contains(small_members, name)) small_[name] = value;
  }

  void add(const Variation& variation) {
    Frame frame;
    frame.patch = variation.patch.dump();
    frame.variation = variation.values.is_null() ? frame.patch : variation.values.dump();
    if (frame.variation.size() > variation_bytes_max) frame.variation.clear();
    frame.complete = !content_ || changes_content(variation);
    bytes_ += frame.patch.size();
    std::optional<std::string> text = document_text(variation, frame.complete);
    if (!text) return add_issue({variation.place, "conflict", "the values cannot be set together" + variation.suffix});
    if (add_exceeded_limit(variation.place)) return;
    auto parsed = parse_scene(*text, limits_.document, &frame.digests);
    if (!parsed) return add_refusal(parsed.error(), variation);
    frame.document = std::move(*parsed);
    if (!frame.document.job.keep)
      return add_issue(
          {variation.place + "/job/keep", "unsupported", "the jobs of a batch are kept" + variation.suffix});
    add_common_content(frame, variation);
    if (issues_.empty()) take_(std::move(frame));
  }
  void add_issue(tracer::Issue issue) {
    if (issues_.size() < issues_max) issues_.push_back(std::move(issue));
  }
  [[nodiscard]] bool full() const { return issues_.size() >= issues_max || over_limit_; }
  std::vector<tracer::Issue> take_issues() { return std::move(issues_); }

 private:
  static bool changes_content(const Variation& variation) {
    return std::ranges::any_of(variation.members, [](const auto& name) { return contains(content_members, name); });
  }

  /// The text to read: the whole document, or its small members and those that are changed.
  std::optional<std::string> document_text(const Variation& variation, bool complete) {
    Json document = complete ? scene_ : small_;
    if (!complete) {
      for (const std::string& name : variation.members)
        if (!small_.contains(name) && scene_.contains(name)) document[name] = scene_[name];
    }
    if (!patch_document(document, variation.patch)) return std::nullopt;
    values_ += count_values(document);
    return document.dump();
  }

  /// Adds what the document has in common with complete ones, and keeps that of the first complete one.
  void add_common_content(Frame& frame, const Variation& variation) {
    if (frame.complete) {
      frame.content = content_of(frame.document.scene);
      if (!changes_content(variation)) content_ = {frame.content, frame.digests};
      return;
    }
    Digests digests = content_->digests;
    for (const std::string_view name : small_members) digests.erase(std::string(name));
    for (const std::string& name : variation.members) digests.erase(name);
    digests.merge(frame.digests);
    frame.digests = std::move(digests);
    frame.content = content_->content;
  }

  bool add_exceeded_limit(const std::string& place) {
    const auto add = [&](const char* name, std::size_t limit, const char* what) {
      add_issue({place, "limit_exceeded", "the limit " + std::string(name) + " is " + std::to_string(limit) + what});
      over_limit_ = true;
    };
    if (bytes_ > limits_.all_bytes) add("batch_bytes", limits_.all_bytes, " for the scene and all patches together");
    if (values_ > limits_.all_values)
      add("batch_values", limits_.all_values, " for the documents that have to be read completely, all together");
    return over_limit_;
  }

  void add_refusal(Refusal& refusal, const Variation& variation) {
    if (refusal.kind != Refusal::Kind::invalid)
      add_issue({variation.place, "limit_exceeded", refusal.detail + variation.suffix});
    for (tracer::Issue& issue : refusal.issues)
      add_issue({variation.place + issue.pointer, std::move(issue.code), issue.detail + variation.suffix});
  }

  /// The part of all documents that do not change it.
  struct Content {
    SceneContent content;
    Digests digests;
  };

  static constexpr int issues_max = 100;  // the documents are alike: more issues would repeat the same
  const Json& scene_;
  Json small_ = Json::object();
  const BatchLimits& limits_;
  const TakeFrame& take_;
  std::optional<Content> content_;  ///< from a valid document
  std::size_t bytes_, values_ = 0;
  bool over_limit_ = false;
  std::vector<tracer::Issue> issues_;
};

void add_frames(const Json& frames, Documents& documents) {
  for (std::size_t i = 0; i < frames.size() && !documents.full(); ++i) {
    Variation variation{frames[i], {}, {}, "/frames/" + std::to_string(i), ""};
    for (const auto& [name, value] : frames[i].items()) variation.members.push_back(name);
    documents.add(variation);
  }
}

/// True if the value that is to contain the place of `pointer` exists.
bool has_parent(const Json& scene, const Pointer& pointer) {
  if (pointer.empty() || !scene.contains(pointer.parent_pointer())) return false;
  const Json& parent = scene.at(pointer.parent_pointer());
  return parent.is_object() || (parent.is_array() && scene.contains(pointer));
}

/// Precondition: has_parent.
Axis axis_of(const Json& scene, const std::string& text, const Json& values) {
  Pointer member(text);
  const char* const operation = scene.at(member.parent_pointer()).is_array() ? "replace" : "add";
  while (!member.parent_pointer().empty()) member.pop_back();
  return {text, member.back(), operation, values.get<std::vector<Json>>()};
}

/// Returns fewer axes than the sweep has, with issues, if some are invalid.
std::vector<Axis> read_axes(const Json& scene, const Json& sweep, Documents& documents) {
  std::vector<Axis> axes;
  for (const auto& [text, values] : sweep.items()) {
    const std::string place = "/sweep/" + nlohmann::detail::escape(text);
    try {
      const Pointer pointer(text);
      if (has_parent(scene, pointer)) {
        axes.push_back(axis_of(scene, text, values));
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

void add_sweep(const std::vector<Axis>& axes, std::size_t count, Documents& documents) {
  std::vector<std::string> members;
  for (const Axis& axis : axes) members.push_back(axis.member);
  for (std::size_t combination = 0; combination < count && !documents.full(); ++combination) {
    Variation variation{Json::array(), Json::object(), members, "/scene", ""};
    std::vector<const Json*> chosen(axes.size());
    std::size_t rest = combination;
    for (std::size_t i = axes.size(); i-- > 0; rest /= axes[i].values.size())
      chosen[i] = &axes[i].values[rest % axes[i].values.size()];
    std::string values;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const Axis& axis = axes[i];
      variation.patch.push_back({{"op", axis.operation}, {"path", axis.text}, {"value", *chosen[i]}});
      variation.values[axis.text] = *chosen[i];
      values += (i == 0 ? "" : ", ") + axis.text + " = " + chosen[i]->dump();
    }
    variation.suffix = " (with " + values + ")";
    documents.add(variation);
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
  fields.optional("name", shape.request.name);
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

std::vector<tracer::Issue> read_documents(std::string_view bytes, Shape& shape, const BatchLimits& limits,
                                          const TakeFrame& take) {
  const Json body = Json::parse(bytes, nullptr, false);
  // read_shape() accepts such numbers as infinite; the library does not.
  if (body.is_discarded()) return {{"", "not_finite", "a number is too large for a double"}};
  const Json& scene = body.at("scene");
  Documents documents(scene, limits, take);
  if (shape.frames) {
    add_frames(body.at("frames"), documents);
  } else {
    const std::vector<Axis> axes = read_axes(scene, body.at("sweep"), documents);
    if (axes.size() == body.at("sweep").size()) add_sweep(axes, shape.count, documents);
    std::string sweep = body.at("sweep").dump();
    if (sweep.size() <= sweep_bytes_max) shape.request.sweep = std::move(sweep);
  }
  shape.request.scene = scene.dump();
  return documents.take_issues();
}

}  // namespace

tracer::Result<BatchRequest, Refusal> parse_batch(std::string_view bytes, const BatchLimits& limits,
                                                  const TakeFrame& take) {
  // The tape is freed before the documents are made.
  auto shape = read_body<Shape>(bytes, limits.document,
                                [&](Reading& reading, Shape& result) { read_shape(reading, limits, result); });
  if (!shape) return std::move(shape.error());
  try {
    std::vector<tracer::Issue> issues = read_documents(bytes, *shape, limits, take);
    if (!issues.empty()) return invalid(std::move(issues));
    shape->request.jobs = static_cast<int>(shape->count);
    return std::move(shape->request);
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  }
}

std::optional<std::string> apply_patch(std::string_view scene, std::string_view patch) {
  Json document = Json::parse(scene, nullptr, false);
  const Json change = Json::parse(patch, nullptr, false);
  if (document.is_discarded() || change.is_discarded() || !patch_document(document, change)) return std::nullopt;
  return document.dump();
}

}  // namespace api
