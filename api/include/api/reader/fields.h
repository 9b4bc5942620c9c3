#pragma once
/// The members of one JSON object, taken by name. A member that is not taken by the end is unknown.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "api/reader/cursor.h"
#include "api/reader/field_values.h"
#include "tracer/document_fields.h"

namespace api {

/// Use: construct, `required` and `optional` for each field, `finish`. If the value is not an object, that is the only
/// issue, which `finish` adds, and every field is absent.
class Fields {
 public:
  /// `kind` names the object in messages ("a sphere").
  Fields(Reading& reading, const Cursor& at, std::string_view kind)
      : reading_(reading), at_(at), group_(kind), kind_(kind), is_object_(at.node->kind == json::Kind::object) {}

  explicit operator bool() const { return is_object_; }
  void set_kind(std::string_view kind) { kind_ = kind; }

  /// The member's value; marks its name as known.
  std::optional<Cursor> take(std::string_view name);

  /// Reads the field if it is present. True if it is present and valid.
  template <class T>
  bool optional(std::string_view name, T&& value) {
    const auto field = take(name);
    return field && read(reading_, *field, std::forward<T>(value));
  }

  /// Reads the field. True if it is present and valid; adds an issue if it is missing.
  template <class T>
  bool required(std::string_view name, T&& value) {
    std::string form(form_of<std::remove_cvref_t<T>>);
    if constexpr (requires { value.choices; })
      for (const auto& [word, meaning] : value.choices) form.append(form.empty() ? "\"" : ", \"").append(word) += '"';
    const auto field = take_required(name, form);
    if (field) return read(reading_, *field, std::forward<T>(value));
    if (is_object_) set_invalid(value);
    return false;
  }

  /// Calls take(), and adds an issue, which names the form of the value, if the field is missing.
  std::optional<Cursor> take_required(std::string_view name, std::string_view form = {});

  /// True if a member has this name, known or not.
  [[nodiscard]] bool has(std::string_view name) const { return reading_.tape.find_key(at_.node, name) != nullptr; }

  /// Adds an issue at a member, which may be missing.
  void add_issue(std::string_view name, std::string_view code, std::string detail);

  /// Adds an issue at the first name; the message lists all of them.
  void report_missing_one_of(std::span<const std::string_view> names);

  /// Adds an issue for each member that was not taken: a duplicate, or unknown, with the name that is probably meant or
  /// else the known ones.
  void finish();

 private:
  Reading& reading_;
  const Cursor& at_;
  std::string_view group_;  ///< the kind before set_kind()
  std::string_view kind_;
  bool is_object_;
  std::array<std::string_view, 40> known_{};  ///< more than any object of the format has
  std::size_t known_count_ = 0;
  std::vector<std::string_view> missing_;  ///< required
};

// ---- alternatives of a variant (shapes, lights)

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

// ---- parts of a scene that list their fields (tracer/document_fields.h)

template <class Owner, class T>
void read_field(Fields& fields, const tracer::Field<Owner, T>& field, Owner& owner) {
  constexpr bool is_optional_member = requires(T member) { member.has_value(); };
  constexpr bool is_integer = std::is_integral_v<T> && !std::is_same_v<T, bool>;
  const tracer::FieldRange& range = field.range;
  const auto read_value = [&](auto&& value) {
    if (is_optional_member || field.presence != tracer::FieldPresence::required) {
      fields.optional(field.name, value);
    } else {
      fields.required(field.name, value);
    }
  };
  if constexpr (is_integer) {
    read_value(integer_in(range, owner.*field.member));
  } else if constexpr (std::is_same_v<T, std::optional<std::int64_t>>) {
    if (range.kind == tracer::FieldRange::time) return read_value(Time{owner.*field.member});
    read_value(
        Integer<T>{owner.*field.member, static_cast<std::int64_t>(range.least), static_cast<std::int64_t>(range.most)});
  } else {
    read_value(owner.*field.member);
  }
}

template <tracer::HasFields Owner>
void read_all_fields(Fields& fields, Owner& owner) {
  tracer::for_each_field<Owner>([&](const auto& field) { read_field(fields, field, owner); });
}

/// An object that has the fields of Owner alone. True if it is an object.
template <tracer::HasFields Owner>
bool read(Reading& reading, const Cursor& at, Owner& owner) {
  Fields fields(reading, at, Owner::noun);
  read_all_fields(fields, owner);
  fields.finish();
  return static_cast<bool>(fields);
}

}  // namespace api
