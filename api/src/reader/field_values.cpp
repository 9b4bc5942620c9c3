#include "api/src/reader/field_values.h"

#include <cmath>

#include "api/src/reader/suggestion.h"

namespace api {
namespace {

/// The common case without a cursor for each number: an array of N finite numbers.
template <std::size_t N>
bool read_plain(const json::Node* node, std::array<double, N>& values) {
  if (node->kind != json::Kind::array || node->size != N) return false;
  for (std::size_t i = 0; i < N; ++i) {
    const json::Node& element = node[1 + i];  // numbers take one node each
    if (element.kind != json::Kind::number || !std::isfinite(element.number)) return false;
    values[i] = element.number;
  }
  return true;
}

}  // namespace

bool read(Reading& reading, const Cursor& at, double& value) {
  if (at.node->kind == json::Kind::number && std::isfinite(at.node->number)) {
    value = at.node->number;
    return true;
  }
  set_nan(value);
  if (at.node->kind == json::Kind::number) {
    add_issue(reading, at, "not_finite", "must be a finite number, got one too large for a double");
  } else {
    add_wrong_type(reading, at, "a number");
  }
  return false;
}

bool read(Reading& reading, const Cursor& at, bool& value) {
  if (at.node->kind != json::Kind::boolean) {
    add_wrong_type(reading, at, "true or false");
    return false;
  }
  value = at.node->truth;
  return true;
}

bool read(Reading& reading, const Cursor& at, tracer::Vec2& value) {
  std::array<double, 2> xy{};
  const bool valid = read_plain(at.node, xy) || read<double, 2>(reading, at, xy);
  value = {xy[0], xy[1]};
  return valid;
}

bool read(Reading& reading, const Cursor& at, tracer::Vec3& value) {
  std::array<double, 3> xyz{};
  const bool valid = read_plain(at.node, xyz) || read<double, 3>(reading, at, xyz);
  value = {xyz[0], xyz[1], xyz[2]};
  return valid;
}

/// Names end up in logs and on terminals.
bool has_control_characters(std::string_view text) {
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) return true;
  }
  return false;
}

bool read(Reading& reading, const Cursor& at, Name name) {
  if (at.node->kind != json::Kind::string) {
    add_wrong_type(reading, at, "a string");
    return false;
  }
  const std::string_view text = at.node->string();
  const std::size_t bytes_max = reading.limits.document.name_bytes;
  if (text.size() > bytes_max) {
    add_issue(reading, at, "limit_exceeded",
              "the limit name_bytes is " + std::to_string(bytes_max) + ", got " + std::to_string(text.size()));
    return false;
  }
  if (has_control_characters(text)) {
    add_issue(reading, at, "malformed", "must not have control characters");
    return false;
  }
  name.value = text;
  return true;
}

bool read_integer(Reading& reading, const Cursor& at, std::int64_t least, std::int64_t most, std::int64_t& value) {
  if (at.node->kind != json::Kind::number) {
    add_wrong_type(reading, at, "an integer");
    return false;
  }
  const double number = at.node->number;
  if (std::isinf(number)) {
    add_issue(reading, at, "not_finite", "must be an integer, got a number too large for a double");
  } else if (number != std::trunc(number)) {
    add_wrong_type(reading, at, "an integer");
  } else if (number < static_cast<double>(least)) {
    add_issue(reading, at, "out_of_range", "must be >= " + std::to_string(least) + ", got " + number_text(number));
  } else if (number > static_cast<double>(most)) {
    add_issue(reading, at, "out_of_range", "must be <= " + std::to_string(most) + ", got " + number_text(number));
  } else {
    value = static_cast<std::int64_t>(number);
    return true;
  }
  return false;
}

void add_unknown_word(Reading& reading, const Cursor& at, std::string_view scope,
                      std::span<const std::string_view> words) {
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "a string");
  if (!reading.can_add_issue()) return;
  const std::string_view text = at.node->string();
  std::string expected;
  for (const std::string_view word : words) expected.append(expected.empty() ? "" : ", ").append(quoted(word));
  reading.issues.push_back({pointer(at), scope.ends_with(".type") ? "unknown_type" : "unknown_value",
                            "must be " + (words.size() > 1 ? "one of " + expected : expected) + ", got " +
                                quoted(text) + did_you_mean(text, words)});
}

bool within_limit(Reading& reading, const Cursor& at, std::string_view limit, std::uint64_t bound) {
  if (at.node->kind < json::Kind::array || at.node->size <= bound) return true;
  add_issue(
      reading, at, "limit_exceeded",
      "the limit " + std::string(limit) + " is " + std::to_string(bound) + ", got " + std::to_string(at.node->size));
  return false;
}

bool expect_length(Reading& reading, const Cursor& at, std::size_t length) {
  if (at.node->kind != json::Kind::array) {
    add_wrong_type(reading, at, "an array of " + std::to_string(length));
    return false;
  }
  if (at.node->size == length) return true;
  add_issue(reading, at, "wrong_length",
            "must have " + std::to_string(length) + " elements, has " + std::to_string(at.node->size));
  return false;
}

}  // namespace api
