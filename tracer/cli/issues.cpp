#include "tracer/cli/issues.h"

#include <string>
#include <string_view>

namespace cli {
namespace {

constexpr std::string_view digits = "0123456789ABCDEF";

bool is_control(unsigned char code) { return code < 0x20 || code == 0x7f; }

std::string printable(std::string_view text) {
  std::string out;
  for (const char character : text) {
    const auto code = static_cast<unsigned char>(character);
    if (is_control(code)) {
      out.append("\\x") += digits[code >> 4U];
      out += digits[code & 15U];
    } else {
      out += character;
    }
  }
  return out;
}

void print(std::FILE* into, const std::string& where, std::string_view code, std::string_view detail) {
  const std::string line = printable(where + " " + std::string(code) + " " + std::string(detail));
  std::fprintf(into, "%s\n", line.c_str());
}

}  // namespace

std::string fragment(std::string_view pointer) {
  std::string out = "#";
  for (const char character : pointer) {
    const auto code = static_cast<unsigned char>(character);
    if (is_control(code) || code > 0x7f ||
        std::string_view(" %\"#<>[\\]^`{|}").find(character) != std::string_view::npos) {
      out += '%';
      out += digits[code >> 4U];
      out += digits[code & 15U];
    } else {
      out += character;
    }
  }
  return out;
}

void print_issue(std::FILE* into, const tracer::Issue& issue) {
  print(into, fragment(issue.pointer), issue.code, issue.detail);
}

void print_issues(std::FILE* into, const api::Refusal& refusal) {
  switch (refusal.kind) {
    case api::Refusal::Kind::not_json:
      print(into, "line " + std::to_string(refusal.line) + ", column " + std::to_string(refusal.column), "not_json",
            refusal.detail);
      break;
    case api::Refusal::Kind::too_large:
      print(into, "#", "too_large", refusal.detail);
      break;
    case api::Refusal::Kind::invalid:
      for (const tracer::Issue& issue : refusal.issues) print_issue(into, issue);
      break;
  }
}

}  // namespace cli
