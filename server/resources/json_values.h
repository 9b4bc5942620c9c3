#pragma once
/// JSON values that several resources share; for the sources of this directory only.

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tracer/validate.h"

namespace resources {

using Json = nlohmann::ordered_json;

/// The text on one line with a newline at its end. Invalid UTF-8 is replaced by U+FFFD.
std::string text_of(const Json& json);

/// RFC 3339 in UTC with milliseconds; null for nullopt.
Json time_json(std::optional<std::int64_t> unix_ms);

/// [{pointer, code, detail}] with pointers as URI fragments.
Json errors_json(const std::vector<tracer::Issue>& errors);

}  // namespace resources
