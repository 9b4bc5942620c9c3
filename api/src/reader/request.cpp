#include "api/reader/request.h"

#include <algorithm>

#include "api/reader/json_parser.h"

namespace api {
namespace {

Refusal too_large(std::string detail) {
  Refusal refusal;
  refusal.kind = Refusal::Kind::too_large;
  refusal.detail = std::move(detail);
  return refusal;
}

}  // namespace

tracer::Result<json::Tape, Refusal> parse_json(std::string_view bytes, const DocumentLimits& limits) {
  if (bytes.size() > limits.bytes) {
    return too_large("the limit bytes is " + std::to_string(limits.bytes) + ", the document has " +
                     std::to_string(bytes.size()));
  }
  auto tape = json::parse(bytes, limits);
  if (tape) return std::move(*tape);
  const std::string_view before = bytes.substr(0, tape.error().offset);
  Refusal refusal;
  refusal.kind = tape.error().limit ? Refusal::Kind::too_large : Refusal::Kind::not_json;
  refusal.detail = std::move(tape.error().detail);
  refusal.line = 1 + static_cast<std::size_t>(std::ranges::count(before, '\n'));
  refusal.column = 1 + before.size() - (before.rfind('\n') + 1);  // npos + 1 is 0
  return refusal;
}

Refusal out_of_memory() { return too_large("reading the document takes more memory than is available"); }

Refusal invalid(std::vector<tracer::Issue> issues) {
  Refusal refusal;
  refusal.detail = issues.size() == 1 ? "the document has an issue"
                                      : "the document has " + std::to_string(issues.size()) + " issues";
  refusal.issues = std::move(issues);
  return refusal;
}

}  // namespace api
