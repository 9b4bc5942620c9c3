#pragma once
/// The members of one JSON object, taken by name. What is not taken at the end is unknown.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "api/src/reader/cursor.h"
#include "api/src/reader/field_values.h"

namespace api {

bool has_member(Reading& reading, const Cursor& at, std::string_view name);  ///< false too when `at` is no object

/// Use: construct, `required` and `optional` for each field, `finish`. When the value is no object, that is the only
/// issue and every field is absent.
class Fields {
 public:
  /// `what` names the object in sentences ("a sphere").
  Fields(Reading& reading, const Cursor& at, std::string_view what);

  explicit operator bool() const { return is_object_; }
  void set_kind(std::string_view what) { what_ = what; }

  /// The member's value; marks its name as known.
  std::optional<Cursor> take(std::string_view name);

  /// Reads the field if it is there. True when it is there and right.
  template <class T>
  bool optional(std::string_view name, T&& value) {
    const auto field = take(name);
    return field && read(reading_, *field, std::forward<T>(value));
  }

  /// The same, and tells when it is missing.
  template <class T>
  bool required(std::string_view name, T&& value) {
    const auto field = take(name);
    if (field) return read(reading_, *field, std::forward<T>(value));
    if (is_object_) {
      set_nan(value);
      report_missing_field(name);
    }
    return false;
  }

  /// Whether a member has this name, known or not.
  [[nodiscard]] bool has(std::string_view name) const { return has_member(reading_, at_, name); }

  void report_missing_field(std::string_view name);
  void report_missing_one_of(
      std::span<const std::string_view> names);  ///< of the first name; the sentence has them all

  /// Tells of members that were not taken: unknown (with the likely name), not rendered by this build, or duplicates.
  void finish();

 private:
  void report_unread_member(std::string_view name);

  Reading& reading_;
  const Cursor& at_;
  std::string_view what_;
  bool is_object_;
  std::array<std::string_view, 24> known_{};  ///< more than any object of the format has
  std::size_t known_count_ = 0;
};

/// Calls `read(member)` for each member of a map from names to things, in document order; tells duplicates.
/// False when it is no object.
template <class ReadMember>
bool for_each_member(Reading& reading, const Cursor& at, ReadMember read_member) {
  if (at.node->kind != json::Kind::object) {
    add_wrong_type(reading, at, "an object");
    return false;
  }
  json::Node* key = at.node + 1;
  for (std::size_t i = 0; i < at.node->size; ++i, key = reading.tape.next(key + 1)) {
    read_member(Cursor{&at, key->string(), 0, true, key + 1});
  }
  return true;
}

}  // namespace api
