#include "api/src/reader/refusals.h"

#include <algorithm>
#include <utility>

namespace api {

Refusal refusal_at(std::string_view bytes, json::Error error) {
  const std::string_view before = bytes.substr(0, error.offset);
  Refusal refusal;
  refusal.kind = error.limit ? Refusal::Kind::too_large : Refusal::Kind::not_json;
  refusal.detail = std::move(error.detail);
  refusal.line = 1 + static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
  refusal.column = 1 + before.size() - (before.rfind('\n') + 1);  // npos + 1 is 0
  return refusal;
}

Refusal too_large(std::string detail) {
  Refusal refusal;
  refusal.kind = Refusal::Kind::too_large;
  refusal.detail = std::move(detail);
  return refusal;
}

Refusal too_many_bytes(std::size_t seen, std::size_t limit) {
  return too_large("the limit bytes is " + std::to_string(limit) + ", the document has " + std::to_string(seen));
}

Refusal invalid(std::vector<tracer::Issue> issues) {
  Refusal refusal;
  refusal.kind = Refusal::Kind::invalid;
  refusal.detail = issues.size() == 1 ? "the document has an issue"
                                      : "the document has " + std::to_string(issues.size()) + " issues";
  refusal.issues = std::move(issues);
  return refusal;
}

}  // namespace api
