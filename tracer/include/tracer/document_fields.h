#pragma once
/// Tables of the fields of documents. A part of a scene lists its fields once: the reader, validation, the geometry
/// hash and the JSON schema follow from the list, and the tables of api/docs/scene.md are compared with it.

#include <array>
#include <cstddef>
#include <string_view>
#include <tuple>
#include <utility>

namespace tracer {

/// Range that a field's numbers must lie in (tracer/limits.h).
struct FieldRange {
  enum Kind {
    any,            ///< finite, or no number
    position,       ///< coordinates within `coordinate_max`
    direction,      ///< a position of any length > 0
    length,         ///< > 0, from `length_min` to `coordinate_max`
    length_or_0,    ///< >= 0, at most `coordinate_max`
    texture_point,  ///< components within `value_max`
    factor,         ///< >= 0, at most `value_max`
    exponent,       ///< >= 0, without an upper bound
    ratio,          ///< > 0; the number and its inverse are at most `value_max`
    time,           ///< milliseconds since 1970 UTC, a text in documents
    interval        ///< [least, most]
  };
  Kind kind;
  double least, most;

  constexpr FieldRange(Kind range = any, double low = 0, double high = 0) : kind(range), least(low), most(high) {}
  static constexpr FieldRange within(double low, double high) { return {interval, low, high}; }
  static constexpr FieldRange fraction() { return within(0, 1); }
  /// An integer from 1 to 2^32 - 1.
  static constexpr FieldRange count() { return within(1, 4294967295); }
};

enum class FieldPresence {
  required,
  optional,  ///< the default is that of the member
  derived    ///< the default follows from other fields
};

/// A member of Owner that the document calls `name`. A member of type std::optional is never required.
template <class Owner, class T>
struct Field {
  std::string_view name;
  T Owner::*member;
  FieldRange range{};
  FieldPresence presence = FieldPresence::required;
};
/// Clang deduces the arguments of an aggregate from version 17 on.
template <class Owner, class T>
Field(std::string_view name, T Owner::*member, FieldRange range = {}, FieldPresence presence = {}) -> Field<Owner, T>;

/// A field whose default is that of the member.
template <class Owner, class T>
constexpr Field<Owner, T> optional_field(std::string_view name, T Owner::*member, FieldRange range = {}) {
  return {name, member, range, FieldPresence::optional};
}

/// Calls visit(field) for each field of Owner, in the document's order.
template <class Owner, class Visit>
constexpr void for_each_field(const Visit& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, Owner::fields());
}

/// Parts of a scene that list their fields.
template <class T>
concept HasFields = requires {
  T::fields();
};

/// A word of a closed set and its value.
template <class T>
using Word = std::pair<std::string_view, T>;

/// The words of the values of an enumeration in their order, from `first` on.
template <class Enum, std::size_t size>
constexpr std::array<Word<Enum>, size> in_order(Enum first, const std::string_view (&texts)[size]) {
  std::array<Word<Enum>, size> all;
  for (std::size_t i = 0; i < size; ++i) all[i] = {texts[i], static_cast<Enum>(static_cast<std::size_t>(first) + i)};
  return all;
}

/// The words of an enumeration in documents. A function words_of() beside it lists them; its argument is the value 0.
template <class Enum>
inline constexpr auto words = words_of(Enum{});

}  // namespace tracer
