#pragma once
/// Numbers in texts.

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace support {

/// A decimal number that is the whole text and fits into the type.
template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  return error == std::errc{} && rest == end ? std::optional(value) : std::nullopt;
}

}  // namespace support
