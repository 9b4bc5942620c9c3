#pragma once
/// Descriptions of document fields. A shape or a light lists its fields once; the reader, validation and the geometry
/// hash iterate over that list.

#include <optional>
#include <string_view>
#include <tuple>

namespace tracer {

/// Range that a field's numbers must lie in (tracer/limits.h).
enum class FieldRange {
  any,           ///< a flag, or numbers without a range of their own
  position,      ///< coordinates within `coordinate_max`
  direction,     ///< a position of any length > 0
  length,        ///< > 0, from `length_min` to `coordinate_max`
  length_or_0,   ///< >= 0, at most `coordinate_max`
  angle_deg,     ///< [0, 180]
  texture_point  ///< components within `value_max`
};

enum class FieldPresence { required, optional };

/// A member of Owner that the document calls `name`. A member of type std::optional is never required.
template <class Owner, class T>
struct Field {
  std::string_view name;
  T Owner::*member;
  FieldRange range = FieldRange::any;
  FieldPresence presence = FieldPresence::required;
};
/// Clang deduces the arguments of an aggregate from version 17 on.
template <class Owner, class T>
Field(std::string_view name, T Owner::*member, FieldRange range = {}, FieldPresence presence = {}) -> Field<Owner, T>;

/// Calls visit(field) for each field of Owner, in the document's order.
template <class Owner, class Visit>
constexpr void for_each_field(const Visit& visit) {
  std::apply([&](const auto&... field) { (visit(field), ...); }, Owner::fields());
}

/// Shapes and lights that list their fields.
template <class T>
concept HasFields = requires {
  T::fields();
};

}  // namespace tracer
