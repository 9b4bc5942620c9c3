#pragma once
/// Reads the alternatives of a variant, shapes or lights, by their `type` and their lists of fields
/// (tracer/fields.h).

#include <array>
#include <cstddef>
#include <utility>
#include <variant>

#include "api/src/reader/fields.h"
#include "tracer/fields.h"

namespace api {

/// Words of `type` with the indices of the alternatives.
template <class... Types>
constexpr std::array<std::pair<std::string_view, std::size_t>, sizeof...(Types)> type_words(
    const std::variant<Types...>* /*list*/) {
  std::size_t index = 0;
  return {{{Types::type, index++}...}};
}

/// Calls read(alternative) with the alternative of that index, newly made.
template <class Read, class... Types>
void read_alternative(std::variant<Types...>& variant, std::size_t index, const Read& read) {
  std::size_t i = 0;
  (void)((i++ == index && (read(variant.template emplace<Types>()), true)) || ...);
}

template <class Owner, class T>
void read_field(Fields& fields, const tracer::Field<Owner, T>& field, Owner& owner) {
  if (field.presence == tracer::FieldPresence::required) {
    fields.required(field.name, owner.*field.member);
  } else {
    fields.optional(field.name, owner.*field.member);
  }
}
template <class Owner, class T>
void read_field(Fields& fields, const tracer::Field<Owner, std::optional<T>>& field, Owner& owner) {
  if (fields.has(field.name)) fields.optional(field.name, (owner.*field.member).emplace());
}

template <tracer::HasFields Owner>
void read_all_fields(Fields& fields, Owner& owner) {
  tracer::for_each_field<Owner>([&](const auto& field) { read_field(fields, field, owner); });
}

}  // namespace api
