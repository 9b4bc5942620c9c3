#include "api/src/json/json_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

namespace api::json {
namespace {

using Value = nlohmann::ordered_json;

template <class Number, class... Format>
void append_number(std::string& text, Number number, Format... format) {
  std::array<char, 32> digits{};
  text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number, format...).ptr);
}

void append_double(std::string& text, double number) {
  const double magnitude = std::abs(number);
  if (!std::isfinite(number)) {
    text += "null";
  } else if (magnitude != 0 && (magnitude < 1e-4 || magnitude >= 1e15)) {
    append_number(text, number, std::chars_format::scientific);
  } else {
    append_number(text, number, std::chars_format::fixed);
    if (magnitude == std::floor(magnitude)) text += ".0";
  }
}

/// Recursion is as deep as the value.
void append_value(std::string& text, const Value& value) {
  char before = value.is_object() ? '{' : '[';
  if (value.is_object()) {
    if (value.empty()) text += before;
    for (const auto& [name, member] : value.get_ref<const Value::object_t&>()) {
      text += std::exchange(before, ',');
      append_string(text, name);
      text += ':';
      append_value(text, member);
    }
    text += '}';
  } else if (value.is_array()) {
    if (value.empty()) text += before;
    for (const Value& element : value) {
      text += std::exchange(before, ',');
      append_value(text, element);
    }
    text += ']';
  } else if (value.is_string()) {
    append_string(text, value.get_ref<const std::string&>());
  } else if (value.is_number_float()) {
    append_double(text, value.get<double>());
  } else if (value.is_number_unsigned()) {
    append_number(text, value.get<std::uint64_t>());
  } else if (value.is_number_integer()) {
    append_number(text, value.get<std::int64_t>());
  } else {
    text += value.is_null() ? "null" : value.get<bool>() ? "true" : "false";
  }
}

}  // namespace

void append_string(std::string& text, std::string_view value) {
  const auto is_escaped = [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '"' || c == '\\'; };
  if (std::any_of(value.begin(), value.end(), is_escaped)) {
    text += Value(value).dump();
  } else {
    text.append("\"").append(value).append("\"");
  }
}

std::string text_of(const nlohmann::ordered_json& value) {
  std::string text;
  append_value(text, value);
  return text;
}

}  // namespace api::json
