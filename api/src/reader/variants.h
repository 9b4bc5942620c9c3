#pragma once
/// Readers of the alternatives of a variant, shapes or lights, by their `type` and their lists of fields
/// (tracer/fields.h).

#include <array>
#include <cstddef>
#include <utility>
#include <variant>

#include "api/src/reader/fields.h"
#include "tracer/fields.h"

namespace api {

template <class... Types>
constexpr auto make_type_words(const std::variant<Types...>* /*deduces Types*/) {
  std::size_t index = 0;
  return std::array<Word<std::size_t>, sizeof...(Types)>{{{Types::type, index++}...}};
}

/// The words of `type` with the indices of the variant's alternatives.
template <class Variant>
inline constexpr auto type_words = make_type_words(static_cast<const Variant*>(nullptr));

/// Emplaces the alternative of that index and calls read(alternative).
template <class Read, class... Types>
void read_alternative(std::variant<Types...>& variant, std::size_t index, const Read& read) {
  std::size_t i = 0;
  (void)((i++ == index && (read(variant.template emplace<Types>()), true)) || ...);
}

template <class Owner, class T>
void read_field(Fields& fields, const tracer::Field<Owner, T>& field, Owner& owner) {
  constexpr bool is_optional_member = requires(T member) { member.has_value(); };
  if (is_optional_member || field.presence == tracer::FieldPresence::optional) {
    fields.optional(field.name, owner.*field.member);
  } else {
    fields.required(field.name, owner.*field.member);
  }
}

template <tracer::HasFields Owner>
void read_all_fields(Fields& fields, Owner& owner) {
  tracer::for_each_field<Owner>([&](const auto& field) { read_field(fields, field, owner); });
}

}  // namespace api
