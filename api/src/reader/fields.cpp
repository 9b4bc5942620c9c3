#include "api/src/reader/fields.h"

#include <cassert>
#include <string>

#include "api/src/reader/suggestion.h"

namespace api {

Fields::Fields(Reading& reading, const Cursor& at, std::string_view what)
    : reading_(reading), at_(at), what_(what), is_object_(at.node->kind == json::Kind::object) {
  if (!is_object_) add_wrong_type(reading, at, "an object");
}

std::optional<Cursor> Fields::take(std::string_view name) {
  assert(known_count_ < known_.size());
  known_[known_count_++] = name;
  if (!is_object_) return std::nullopt;
  json::Node* key = at_.node + 1;
  for (std::size_t i = 0; i < at_.node->size; ++i, key = reading_.tape.next(key + 1)) {
    if (key->string() != name) continue;
    key->used = true;
    return Cursor{&at_, key->string(), 0, true, key + 1};
  }
  return std::nullopt;
}

bool has_member(Reading& reading, const Cursor& at, std::string_view name) {
  if (at.node->kind != json::Kind::object) return false;
  json::Node* key = at.node + 1;
  for (std::size_t i = 0; i < at.node->size; ++i, key = reading.tape.next(key + 1)) {
    if (key->string() == name) return true;
  }
  return false;
}

void Fields::report_missing_field(std::string_view name) {
  if (!reading_.can_add_issue()) return;
  reading_.issues.push_back(
      {pointer_to_member(at_, name), "missing_field", std::string(what_) + " must have " + quoted(name)});
}

void Fields::report_missing_one_of(std::span<const std::string_view> names) {
  if (!reading_.can_add_issue()) return;
  std::string all;
  for (const std::string_view name : names) all += (all.empty() ? "" : ", ") + quoted(name);
  reading_.issues.push_back(
      {pointer_to_member(at_, names.front()), "missing_field", std::string(what_) + " must have one of " + all});
}

void Fields::finish() {
  if (!is_object_) return;
  json::Node* key = at_.node + 1;
  for (std::size_t i = 0; i < at_.node->size; ++i, key = reading_.tape.next(key + 1)) {
    if (!key->used && reading_.can_add_issue()) report_unread_member(key->string());
  }
}

void Fields::report_unread_member(std::string_view name) {
  const std::span<const std::string_view> known(known_.data(), known_count_);
  std::string code = "unknown_field";
  std::string detail;
  if (std::find(known.begin(), known.end(), name) != known.end()) {
    code = "duplicate_key";
    detail = quoted(name) + " is written twice";
  } else {
    detail = quoted(name) + " is not a field of " + std::string(what_) + did_you_mean(name, known);
  }
  reading_.issues.push_back({pointer_to_member(at_, name), std::move(code), std::move(detail)});
}

}  // namespace api
