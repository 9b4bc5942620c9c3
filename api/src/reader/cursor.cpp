#include "api/src/reader/cursor.h"

#include <charconv>
#include <cmath>
#include <utility>

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
  if (at.is_member) {
    append_token(text, at.key);
  } else {
    text += '/' + std::to_string(at.index);
  }
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

void add_issue(Reading& reading, const Cursor& at, std::string_view code, std::string detail) {
  if (reading.can_add_issue()) reading.issues.push_back({pointer(at), std::string(code), std::move(detail)});
}

void add_wrong_type(Reading& reading, const Cursor& at, std::string_view expected) {
  if (!reading.can_add_issue()) return;
  reading.issues.push_back(
      {pointer(at), "wrong_type", "must be " + std::string(expected) + ", got " + describe(*at.node)});
}

std::string quoted(std::string_view text) {
  constexpr std::size_t bytes_max = 64;
  std::string result = "\"";
  std::size_t size = text.size();
  if (size > bytes_max) {
    size = bytes_max;
    while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0) == 0x80) --size;  // not within a character
  }
  for (const char c : text.substr(0, size)) result += static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? '?' : c;
  return result + (size < text.size() ? "...\"" : "\"");
}

std::string describe(const json::Node& node) {
  switch (node.kind) {
    case json::Kind::null:
      return "null";
    case json::Kind::boolean:
      return node.truth ? "true" : "false";
    case json::Kind::number:
      return "the number " + number_text(node.number);
    case json::Kind::string:
      return "the string " + quoted(node.string());
    case json::Kind::array:
      return "an array of " + std::to_string(node.size);
    case json::Kind::object:
      return "an object";
  }
  return {};
}

std::string number_text(double value) {
  if (std::isinf(value)) return "a number too large for a double";
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

}  // namespace api
