#include "api/src/reader/field_values.h"

#include <cmath>

#include "api/src/reader/issue_text.h"

namespace api {
namespace {

/// Reads an array of N finite numbers without a cursor for each: the common case, in meshes by far.
template <std::size_t N>
bool read_vector(Reading& reading, const Cursor& at, std::array<double, N>& values) {
  bool plain = at.node->kind == json::Kind::array && at.node->size == N;
  for (std::size_t i = 0; plain && i < N; ++i) {
    const json::Node& element = at.node[1 + i];  // numbers take one node each
    plain = element.kind == json::Kind::number && std::isfinite(element.number);
    values[i] = element.number;
  }
  return plain || read<double, N>(reading, at, values);
}

}  // namespace

bool read(Reading& reading, const Cursor& at, double& value) {
  const bool is_number = at.node->kind == json::Kind::number;
  if (is_number && std::isfinite(at.node->number)) {
    value = at.node->number;
    return true;
  }
  set_invalid(value);
  if (!is_number) return add_wrong_type(reading, at, "a number");
  return add_issue(reading, at, "not_finite", "must be a finite number, got one too large for a double");
}

bool read(Reading& reading, const Cursor& at, bool& value) {
  if (at.node->kind != json::Kind::boolean) return add_wrong_type(reading, at, "true or false");
  value = at.node->truth;
  return true;
}

bool read(Reading& reading, const Cursor& at, std::uint32_t& value) {
  return read(reading, at, Integer<std::uint32_t>{value});
}

bool read(Reading& reading, const Cursor& at, tracer::Vec2& value) {
  std::array<double, 2> xy{};
  const bool valid = read_vector(reading, at, xy);
  value = {xy[0], xy[1]};
  return valid;
}

bool read(Reading& reading, const Cursor& at, tracer::Vec3& value) {
  std::array<double, 3> xyz{};
  const bool valid = read_vector(reading, at, xyz);
  value = {xyz[0], xyz[1], xyz[2]};
  return valid;
}

/// Names are written to logs and terminals.
bool has_control_characters(std::string_view text) {
  return std::any_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; });
}

bool read(Reading& reading, const Cursor& at, Name name) {
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "a string");
  const std::string_view text = at.node->string();
  const std::size_t bytes_max = reading.limits.document.name_bytes;
  if (text.size() > bytes_max) return add_limit_exceeded(reading, at, "name_bytes", bytes_max, text.size());
  if (has_control_characters(text)) return add_issue(reading, at, "malformed", "must not have control characters");
  name.value = text;
  return true;
}

bool read_integer(Reading& reading, const Cursor& at, std::int64_t least, std::int64_t most, std::int64_t& value) {
  const double number = at.node->number;
  if (at.node->kind != json::Kind::number) return add_wrong_type(reading, at, "an integer");
  if (std::isinf(number))
    return add_issue(reading, at, "not_finite", "must be an integer, got a number too large for a double");
  if (number != std::trunc(number)) return add_wrong_type(reading, at, "an integer");
  if (number < static_cast<double>(least))
    return add_issue(reading, at, "out_of_range",
                     "must be >= " + std::to_string(least) + ", got " + number_text(number));
  if (number > static_cast<double>(most))
    return add_issue(reading, at, "out_of_range",
                     "must be <= " + std::to_string(most) + ", got " + number_text(number));
  value = static_cast<std::int64_t>(number);
  return true;
}

bool add_unknown_word(Reading& reading, const Cursor& at, std::span<const std::string_view> choices) {
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "a string");
  if (!reading.can_add_issue()) return false;
  const std::string_view text = at.node->string();
  reading.issues.push_back({pointer(at), at.is_member && at.key == "type" ? "unknown_type" : "unknown_value",
                            (choices.size() > 1 ? "must be one of " : "must be ") + list_of(choices) + ", got " +
                                quoted(text) + did_you_mean(text, choices)});
  return false;
}

bool within_limit(Reading& reading, const Cursor& at, std::string_view limit, std::uint64_t bound) {
  if (at.node->kind < json::Kind::array || at.node->size <= bound) return true;
  return add_limit_exceeded(reading, at, limit, bound, at.node->size);
}

bool expect_length(Reading& reading, const Cursor& at, std::size_t length) {
  if (at.node->kind != json::Kind::array) return add_wrong_type(reading, at, "an array of " + std::to_string(length));
  if (at.node->size == length) return true;
  return add_issue(reading, at, "wrong_length",
                   "must have " + std::to_string(length) + " elements, has " + std::to_string(at.node->size));
}

}  // namespace api
