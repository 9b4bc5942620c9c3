#pragma once
/// Reading the values that fields have. Each `read` stores what the document says and answers true, or tells what is
/// wrong and stores NaN (numbers: a rule about them is not broken a second time) or leaves the default (all else).

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/src/reader/cursor.h"

namespace api {

/// An integer field and the values it can hold, both ends included.
template <class T>
struct Integer {
  T& value;
  T least = 0;
  T most = std::numeric_limits<T>::max();
};

/// A text for people: at most `name_bytes`, no control characters.
struct Name {
  std::string& value;
};

/// A time as RFC 3339 (section 5.6) writes it, with any offset and any fraction, as milliseconds since 1970 UTC
/// (further digits cut off). 1970 to 9999; leap seconds are the second after.
struct Time {
  std::optional<std::int64_t>& value;
};

/// One word of a closed set; `scope` names the field ("camera.type").
template <class T>
struct Word {
  using Meaning = std::pair<std::string_view, T>;
  T& value;
  std::string_view scope;
  std::span<const Meaning> words;
};

bool read(Reading& reading, const Cursor& at, double& value);
bool read(Reading& reading, const Cursor& at, bool& value);
bool read(Reading& reading, const Cursor& at, tracer::Vec2& value);
bool read(Reading& reading, const Cursor& at, tracer::Vec3& value);
bool read(Reading& reading, const Cursor& at, tracer::Color& value);  ///< any of the four forms (color.cpp)
bool read(Reading& reading, const Cursor& at, Name name);
bool read(Reading& reading, const Cursor& at, Time time);

/// Integers are numbers without a fraction, whatever their spelling (3, 3.0, 3e0), up to 2^53 - 1: beyond that a double
/// cannot tell neighbours apart (RFC 7493, section 2.2).
bool read_integer(Reading& reading, const Cursor& at, std::int64_t least, std::int64_t most, std::int64_t& value);
inline constexpr std::int64_t exact_max = (std::int64_t{1} << 53) - 1;

/// Tells that the value is none of `words`: "unknown_type" where `scope` ends with ".type", else "unknown_value".
void add_unknown_word(Reading& reading, const Cursor& at, std::string_view scope,
                      std::span<const std::string_view> words);

bool has_control_characters(std::string_view text);

bool expect_length(Reading& reading, const Cursor& at, std::size_t length);  ///< an array of exactly that many

/// Whether the array or object is within a limit of the scene. Asked before its elements are read, so that what is too
/// much is never held; when it is not, that is told and the elements are not read.
bool within_limit(Reading& reading, const Cursor& at, std::string_view limit, std::uint64_t bound);

/// Puts NaN where a number could not be read.
inline void set_nan(double& value) { value = std::numeric_limits<double>::quiet_NaN(); }
inline void set_nan(tracer::Vec2& value) { set_nan(value.x); }
inline void set_nan(tracer::Vec3& value) { set_nan(value.x); }
inline void set_nan(tracer::Color& value) { set_nan(value.r); }
template <class T>
void set_nan(T&&) {}

template <class T>
bool read(Reading& reading, const Cursor& at, Integer<T> integer) {
  std::int64_t value = 0;
  const auto most =
      static_cast<std::int64_t>(std::min<std::uint64_t>(static_cast<std::uint64_t>(integer.most), exact_max));
  if (!read_integer(reading, at, static_cast<std::int64_t>(integer.least), most, value)) return false;
  integer.value = static_cast<T>(value);
  return true;
}

template <class T>
bool read(Reading& reading, const Cursor& at, Word<T> word) {
  for (const auto& [text, meaning] : word.words) {
    if (at.node->kind != json::Kind::string || at.node->string() != text) continue;
    word.value = meaning;
    return true;
  }
  std::vector<std::string_view> words;
  for (const auto& [text, meaning] : word.words) words.push_back(text);
  add_unknown_word(reading, at, word.scope, words);
  return false;
}

template <class T, std::size_t N>
bool read(Reading& reading, const Cursor& at, std::array<T, N>& values) {
  if (!expect_length(reading, at, N)) {
    for (T& value : values) set_nan(value);
    return false;
  }
  bool all_valid = true;
  for_each_element(reading, at,
                   [&](const Cursor& element) { all_valid &= read(reading, element, values[element.index]); });
  return all_valid;
}

}  // namespace api
