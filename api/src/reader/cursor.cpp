#include "api/src/reader/cursor.h"

#include <utility>

#include "api/src/reader/issue_order.h"
#include "api/src/reader/issue_text.h"

namespace api {
namespace {

void append_token(std::string& text, std::string_view key) {
  text += '/';
  for (const char c : key) {
    if (c == '~') {
      text += "~0";
    } else if (c == '/') {
      text += "~1";
    } else {
      text += c;
    }
  }
}

void append_pointer(std::string& text, const Cursor& at) {
  if (at.parent == nullptr) return;  // not deeper than DocumentLimits::depth
  append_pointer(text, *at.parent);
  append_token(text, at.is_member ? at.key : std::to_string(at.index));
}

}  // namespace

std::string pointer(const Cursor& at) {
  std::string text;
  append_pointer(text, at);
  return text;
}

std::string pointer_to_member(const Cursor& at, std::string_view key) {
  std::string text = pointer(at);
  append_token(text, key);
  return text;
}

bool Reading::can_add_issue() {
  if (issues.size() < issues_max) return true;
  ++omitted_issues;
  return false;
}

std::vector<tracer::Issue> Reading::take_issues() {
  sort_by_position(issues, tape, root.node);
  if (omitted_issues > 0) issues.push_back({"", "too_many_issues", "and " + std::to_string(omitted_issues) + " more"});
  return std::move(issues);
}

bool add_issue(Reading& reading, const Cursor& at, std::string_view code, std::string detail) {
  if (reading.can_add_issue()) reading.issues.push_back({pointer(at), std::string(code), std::move(detail)});
  return false;
}

bool add_wrong_type(Reading& reading, const Cursor& at, std::string_view expected) {
  if (!reading.can_add_issue()) return false;
  reading.issues.push_back(
      {pointer(at), "wrong_type", "must be " + std::string(expected) + ", got " + describe(*at.node)});
  return false;
}

bool add_limit_exceeded(Reading& reading, const Cursor& at, std::string_view limit, std::uint64_t bound,
                        std::uint64_t seen) {
  return add_issue(
      reading, at, "limit_exceeded",
      "the limit " + std::string(limit) + " is " + std::to_string(bound) + ", got " + std::to_string(seen));
}

}  // namespace api
