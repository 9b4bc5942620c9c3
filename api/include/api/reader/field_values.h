#pragma once
/// Readers of field values. Each `read` stores the value and returns true, or adds an issue, makes the value invalid
/// (set_invalid) and returns false. Overloads for the format's own types are in sections.h.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "api/reader/cursor.h"
#include "tracer/document_fields.h"

namespace api {

/// Integers are numbers without a fraction, whatever their spelling (3, 3.0, 3e0), up to 2^53 - 1: above that, doubles
/// have gaps (RFC 7493, section 2.2).
inline constexpr std::int64_t exact_max = (std::int64_t{1} << 53) - 1;

template <class T>
inline constexpr std::int64_t integer_max =
    static_cast<std::int64_t>(std::min<std::uint64_t>(std::numeric_limits<T>::max(), exact_max));

/// An integer field and its range, both ends included.
template <class T>
struct Integer {
  T& value;
  std::int64_t least = 0;
  std::int64_t most = integer_max<T>;
};

/// The integers of a field.
template <class T>
Integer<T> integer_in(const tracer::FieldRange& range, T& value) {
  if (range.kind == tracer::FieldRange::interval)
    return {value, static_cast<std::int64_t>(range.least), static_cast<std::int64_t>(range.most)};
  return {value, std::is_signed_v<T> ? std::int64_t{std::numeric_limits<T>::min()} : 0};
}

/// A time in RFC 3339 (section 5.6), with any offset and any fraction, as milliseconds since 1970 UTC (rounded down).
/// Years 1970 to 9999; a leap second is the second after it.
struct Time {
  std::optional<std::int64_t>& value;
};

/// Such a text, as in a document.
std::optional<std::int64_t> parse_time(std::string_view text);

using tracer::Word;
using tracer::words;

template <class T>
struct OneOf {
  T& value;
  std::span<const Word<T>> choices;
};

bool read(Reading& reading, const Cursor& at, double& value);
bool read(Reading& reading, const Cursor& at, bool& value);
bool read(Reading& reading, const Cursor& at, std::uint32_t& value);
bool read(Reading& reading, const Cursor& at, tracer::Vec2& value);
bool read(Reading& reading, const Cursor& at, tracer::Vec3& value);
bool read(Reading& reading, const Cursor& at, tracer::Color& value);  ///< any of its forms
/// A text for people: at most `name_bytes`, no control characters.
bool read(Reading& reading, const Cursor& at, std::string& name);
bool read(Reading& reading, const Cursor& at, Time time);
bool read_integer(Reading& reading, const Cursor& at, std::int64_t least, std::int64_t most, std::int64_t& value);

/// True if the value is a string; else adds an issue, which names the form.
bool expect_string(Reading& reading, const Cursor& at, std::string_view form = "a string");

/// Adds that the value is none of `choices`: "unknown_type" for a field `type`, else "unknown_value". Returns false.
bool add_unknown_word(Reading& reading, const Cursor& at, std::span<const std::string_view> choices);

bool has_control_characters(std::string_view text);

/// True if the value is an array of that length; else adds an issue, which names the form.
bool expect_length(Reading& reading, const Cursor& at, std::size_t length, std::string_view form = {});

/// The form of a value of this type in messages.
template <class T>
inline constexpr std::string_view form_of{};
template <>
inline constexpr std::string_view form_of<double> = "NUMBER";
template <>
inline constexpr std::string_view form_of<tracer::Vec2> = "[u, v]";
template <>
inline constexpr std::string_view form_of<tracer::Vec3> = "[x, y, z]";
template <>
inline constexpr std::string_view form_of<std::array<tracer::Vec3, 3>> = "[[x, y, z], [x, y, z], [x, y, z]]";
template <>
inline constexpr std::string_view form_of<std::array<tracer::Color, 2>> = "[COLOUR, COLOUR]";
template <>
inline constexpr std::string_view form_of<tracer::Color> = "COLOUR";
template <>
inline constexpr std::string_view form_of<tracer::MaterialId> = "a material's name or {\"color\": COLOUR, ...}";

/// False, with an issue, if the array or object has more elements than the limit. To be called before its elements are
/// read, which bounds the memory.
bool within_limit(Reading& reading, const Cursor& at, std::string_view limit, std::uint64_t bound);

inline constexpr std::uint32_t invalid_index = std::numeric_limits<std::uint32_t>::max();

/// Sets NaN or an invalid index, so that no further issue is found in a value that could not be read. Other types keep
/// their default.
inline void set_invalid(double& value) { value = std::numeric_limits<double>::quiet_NaN(); }
inline void set_invalid(tracer::Vec2& value) { set_invalid(value.x); }
inline void set_invalid(tracer::Vec3& value) { set_invalid(value.x); }
inline void set_invalid(tracer::Color& value) { set_invalid(value.r); }
template <class T>
void set_invalid(T& value) {
  if constexpr (requires { value.index = invalid_index; }) value.index = invalid_index;
}

template <class T>
bool read(Reading& reading, const Cursor& at, Integer<T> integer) {
  std::int64_t value = 0;
  const bool valid = read_integer(reading, at, integer.least, integer.most, value);
  if constexpr (std::is_integral_v<T>) {
    integer.value = static_cast<T>(value);
  } else {  // optional
    integer.value = static_cast<typename T::value_type>(value);
  }
  return valid;
}

template <class T>
bool read(Reading& reading, const Cursor& at, OneOf<T> word) {
  for (const auto& [text, meaning] : word.choices) {
    if (at.node->kind != json::Kind::string || at.node->string() != text) continue;
    word.value = meaning;
    return true;
  }
  std::vector<std::string_view> texts;
  for (const auto& [text, meaning] : word.choices) texts.push_back(text);
  return add_unknown_word(reading, at, texts);
}

template <class Enum>
requires std::is_enum_v<Enum>
bool read(Reading& reading, const Cursor& at, Enum& value) {
  return read(reading, at, OneOf<Enum>{value, words<Enum>});
}

template <class T, std::size_t N>
bool read(Reading& reading, const Cursor& at, std::array<T, N>& values) {
  bool all_valid = expect_length(reading, at, N, form_of<std::array<T, N>>);
  if (!all_valid) {
    for (T& value : values) set_invalid(value);
    return false;
  }
  for_each_element(reading, at,
                   [&](const Cursor& element) { all_valid &= read(reading, element, values[element.index]); });
  return all_valid;
}

/// Replaces the default by the words of the list.
template <class Enum>
bool read(Reading& reading, const Cursor& at, std::vector<Enum>& values) {
  values.clear();
  const auto read_word = [&](const Cursor& element) {
    if (Enum value{}; read(reading, element, value)) values.push_back(value);
  };
  return for_each_element(reading, at, read_word, "a list of words in brackets");
}

/// Sets the optional even if the value is invalid, because the field is present.
template <class T>
bool read(Reading& reading, const Cursor& at, std::optional<T>& value) {
  return read(reading, at, value.emplace());
}

}  // namespace api
