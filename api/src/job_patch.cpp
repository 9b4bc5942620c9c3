#include "api/job_patch.h"

#include <new>
#include <utility>

#include "api/src/json/parse_error.h"
#include "api/src/json/tape.h"
#include "api/src/reader/fields.h"
#include "api/src/reader/issue_order.h"

namespace api {
namespace {

void read_labels(Reading& reading, const Cursor& at, std::map<std::string, std::optional<std::string>>& labels) {
  if (!within_limit(reading, at, "labels", reading.limits.document.labels)) return;
  for_each_member(reading, at, [&](const Cursor& member) {
    const auto [place, is_new] = labels.emplace(member.key, std::nullopt);
    if (!is_new) {
      add_issue(reading, member, "duplicate_key", quoted(member.key) + " is written twice");
    } else if (has_control_characters(member.key)) {
      add_issue(reading, member, "malformed", "a label must not have control characters");
    } else if (member.node->kind != json::Kind::null) {
      read(reading, member, Name{place->second.emplace()});
    }
  });
}

void read_change(Reading& reading, const Cursor& at, RequestedChange& change) {
  Fields fields(reading, at, "a change of a job");
  int priority = 0;
  if (fields.optional("priority", Integer<int>{priority, 0, 100})) change.priority = priority;
  std::string name;
  if (fields.optional("name", Name{name})) change.name = name;
  if (const auto labels = fields.take("labels")) read_labels(reading, *labels, change.labels);
  if (const auto expires_at = fields.take("expires_at")) {
    std::optional<std::int64_t> time;
    const bool never = expires_at->node->kind == json::Kind::null;
    if (never || read(reading, *expires_at, Time{time})) change.expires_at = time;
  }
  fields.finish();
}

tracer::Result<RequestedChange, Refusal> read(std::string_view bytes, const Limits& limits) {
  auto tape = parse_json(bytes, limits.document);
  if (!tape) return std::move(tape.error());
  Reading reading(*tape, limits);
  Cursor root;
  root.node = tape->root();
  RequestedChange change;
  read_change(reading, root, change);
  if (reading.issues.empty()) return change;
  sort_by_position(reading.issues, *tape);
  return invalid(std::move(reading.issues));
}

}  // namespace

tracer::Result<RequestedChange, Refusal> parse_change(std::string_view bytes, const Limits& limits) {
  try {
    return read(bytes, limits);
  } catch (const std::bad_alloc&) {
    return too_large("reading the document takes more memory than there is");
  }
}

}  // namespace api
