#pragma once
/// Why bytes are refused, in the words of api/document.h; shared by everything that reads JSON from outside.

#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"
#include "api/src/json/tape.h"

namespace api {

/// The bytes as a tape, or why not: too long, no JSON (line and column), over another limit.
tracer::Result<json::Tape, Refusal> parse_json(std::string_view bytes, const DocumentLimits& limits);

Refusal too_large(std::string detail);
Refusal invalid(std::vector<tracer::Issue> issues);  ///< in document order already

}  // namespace api
