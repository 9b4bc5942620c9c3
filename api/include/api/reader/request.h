#pragma once
/// Reads request bodies: JSON with limits to a value, or the reason of its refusal. The body of one endpoint alone is
/// read beside its handler.

#include <map>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/document.h"
#include "api/reader/cursor.h"
#include "api/reader/json_parser.h"
#include "tracer/result.h"

namespace api {

/// The bytes as a tape. Refused if they are too long, not JSON (with line and column), or over another limit.
tracer::Result<json::Tape, Refusal> parse_json(std::string_view bytes, const DocumentLimits& limits);

Refusal out_of_memory();
Refusal invalid(std::vector<tracer::Issue> issues);  ///< precondition: not empty, in document order

/// Parses `bytes` and calls read(tape, value), which fills the value and returns the issues in document order.
/// Memory that runs out is a refusal.
template <class T, class Read>
tracer::Result<T, Refusal> read_request(std::string_view bytes, const DocumentLimits& limits, const Read& read) {
  try {
    auto tape = parse_json(bytes, limits);
    if (!tape) return std::move(tape.error());
    T value;
    std::vector<tracer::Issue> issues = read(*tape, value);
    if (!issues.empty()) return invalid(std::move(issues));
    return value;
  } catch (const std::bad_alloc&) {
    return out_of_memory();
  }
}

/// The same with read(reading, value), which reads `reading.root`. All issues are reported at once.
template <class T, class Read>
tracer::Result<T, Refusal> read_body(std::string_view bytes, const Limits& limits, const Read& read) {
  return read_request<T>(bytes, limits.document, [&](json::Tape& tape, T& value) {
    Reading reading(tape, limits);
    read(reading, value);
    return reading.take_issues();
  });
}

/// For read_body: the body is one value.
template <class T>
void read_root(Reading& reading, T& value) {
  read(reading, reading.root, value);
}

// ---- Values that other bodies share with documents.

bool read(Reading& reading, const Cursor& at, Webhook& webhook);

/// The labels of a job by name. Null, if it is allowed, is an empty optional.
bool read_labels(Reading& reading, const Cursor& at, bool null_allowed,
                 std::map<std::string, std::optional<std::string>>& labels);

}  // namespace api
