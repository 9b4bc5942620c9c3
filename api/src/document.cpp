#include "api/document.h"

#include <algorithm>
#include <new>
#include <string>
#include <utility>

#include "api/src/json/canonical.h"
#include "api/src/json/parse_error.h"
#include "api/src/json/tape.h"
#include "api/src/reader/issue_order.h"
#include "api/src/reader/scene_document.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

/// What the reader has told of, to leave out what follows from it.
class ReportedIssues {
 public:
  explicit ReportedIssues(const std::vector<tracer::Issue>& issues) {
    for (const tracer::Issue& issue : issues) pointers_.push_back(issue.pointer);
    std::sort(pointers_.begin(), pointers_.end());
  }

  /// Whether the issue is of a value that could not be read, of a part of it, or of a whole that has such a part (but
  /// for limits: a count is right whatever was counted). References are the reader's alone to tell of.
  [[nodiscard]] bool covers(const tracer::Issue& issue) const {
    return issue.code == "unknown_reference" || has_at_or_around(issue.pointer) ||
           (issue.code != "limit_exceeded" && has_inside(issue.pointer));
  }

 private:
  [[nodiscard]] bool has_at_or_around(std::string pointer) const {
    while (!std::binary_search(pointers_.begin(), pointers_.end(), pointer)) {
      if (pointer.empty()) return false;
      pointer.resize(pointer.rfind('/'));
    }
    return true;
  }

  [[nodiscard]] bool has_inside(const std::string& pointer) const {
    const std::string inside = pointer + "/";
    const auto first = std::lower_bound(pointers_.begin(), pointers_.end(), inside);
    return first != pointers_.end() && first->starts_with(inside);
  }

  std::vector<std::string> pointers_;
};

/// Shape first, meaning second; both give the same kind of issue.
std::vector<tracer::Issue> all_issues(Reading& reading, json::Node* root, bool understood) {
  std::vector<tracer::Issue> issues = std::move(reading.issues);
  std::vector<tracer::Issue> rest;
  if (reading.omitted_issues > 0) {
    rest.push_back({"", "too_many_issues", "and " + std::to_string(reading.omitted_issues) + " more"});
  } else if (understood) {
    const ReportedIssues reported(issues);
    std::vector<tracer::Issue> of_meaning = tracer::validate(
        reading.scene(), reading.limits.scene, [&](const tracer::Issue& issue) { return reported.covers(issue); });
    if (!of_meaning.empty() && of_meaning.back().code == "too_many_issues") {
      rest.push_back(std::move(of_meaning.back()));
      of_meaning.pop_back();
    }
    std::move(of_meaning.begin(), of_meaning.end(), std::back_inserter(issues));
  }
  sort_by_position(issues, reading.tape, root);
  std::move(rest.begin(), rest.end(), std::back_inserter(issues));
  return issues;
}

tracer::Result<Document, Refusal> read(std::string_view bytes, const Limits& limits, std::string* canonical) {
  auto tape = parse_json(bytes, limits.document);
  if (!tape) return std::move(tape.error());
  auto document = read_scene(*tape, tape->root(), limits);
  if (!document) return invalid(std::move(document.error()));
  if (canonical != nullptr) *canonical = json::canonical_text(*tape, "job");
  return std::move(*document);
}

}  // namespace

tracer::Result<Document, std::vector<tracer::Issue>> read_scene(json::Tape& tape, json::Node* root,
                                                                const Limits& limits) {
  Reading reading(tape, limits);
  Cursor at;
  at.node = root;
  const bool understood = read_document(reading, at);
  std::vector<tracer::Issue> issues = all_issues(reading, root, understood);
  if (!issues.empty()) return issues;
  return std::move(reading.document);
}

tracer::Result<Document, Refusal> parse_scene(std::string_view bytes, const Limits& limits, std::string* canonical) {
  try {
    return read(bytes, limits, canonical);
  } catch (const std::bad_alloc&) {
    return too_large("reading the document takes more memory than there is");
  }
}

}  // namespace api
