#pragma once
/// Reads a request body: JSON with limits to a value, or the reason of its refusal.

#include <new>
#include <string_view>
#include <utility>
#include <vector>

#include "api/document.h"
#include "api/src/json/json_parser.h"
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

}  // namespace api
