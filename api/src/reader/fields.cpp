#include "api/reader/fields.h"

#include <cassert>
#include <string>

#include "api/reader/issue_text.h"

namespace api {

std::optional<Cursor> Fields::take(std::string_view name) {
  assert(known_count_ < known_.size());
  known_[known_count_++] = name;
  json::Node* const key = reading_.tape.find_key(at_.node, name);
  if (key == nullptr) return std::nullopt;
  key->used = true;
  return Cursor{&at_, key->string(), 0, true, key + 1};
}

std::optional<Cursor> Fields::take_required(std::string_view name, std::string_view form) {
  const auto field = take(name);
  if (field) return field;
  missing_.push_back(name);
  if (is_object_ && reading_.can_add_issue())
    add_issue(name, "missing_field",
              std::string(kind_) + " must have " + quoted(name) + (form.empty() ? "" : ": ") + std::string(form));
  return field;
}

void Fields::add_issue(std::string_view name, std::string_view code, std::string detail) {
  if (reading_.can_add_issue())
    reading_.issues.push_back({pointer_to_member(at_, name), std::string(code), std::move(detail)});
}

void Fields::report_missing_one_of(std::span<const std::string_view> names) {
  if (is_object_ && reading_.can_add_issue())
    add_issue(names.front(), "missing_field", std::string(kind_) + " must have one of " + list_of(names));
}

void Fields::finish() {
  const std::span<const std::string_view> known(known_.data(), known_count_);
  if (!is_object_) {
    add_wrong_type(reading_, at_, "an object with " + list_of(known));
    return;
  }
  for_each_member(reading_, at_, [&](const Cursor& member) {
    if (member.node[-1].used || !reading_.can_add_issue()) return;
    const bool is_duplicate = std::ranges::find(known, member.key) != known.end();
    std::string detail = quoted(member.key);
    if (is_duplicate) {
      detail += " is written twice";
    } else {
      std::string form = suggestion(member.key, kind_, group_, known);
      // A missing field is the likelier of similar names.
      if (form.starts_with("; did you mean"))
        if (std::string missing = did_you_mean(member.key, missing_); !missing.empty()) form = std::move(missing);
      detail +=
          " is not a field of " + std::string(kind_) + (form.empty() ? "; its fields are " + list_of(known) : form);
    }
    reading_.issues.push_back({pointer(member), is_duplicate ? "duplicate_key" : "unknown_field", std::move(detail)});
  });
}

}  // namespace api
