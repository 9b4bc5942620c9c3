#pragma once
/// Writes JSON as text without white space: as nlohmann's dump(), with fewer instructions.

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace api::json {

/// Appends `value` as a string. Precondition: it is UTF-8.
void append_string(std::string& text, std::string_view value);

/// Equal to value.dump(). Precondition: its strings are UTF-8.
std::string text_of(const nlohmann::ordered_json& value);

}  // namespace api::json
