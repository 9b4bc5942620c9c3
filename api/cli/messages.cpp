#include "api/cli/messages.h"

#include <string_view>

#include "api/report.h"
#include "tracer/warnings.h"

namespace cli {
namespace {

std::string printable(std::string_view text) {
  constexpr std::string_view digits = "0123456789ABCDEF";
  std::string out;
  for (const char character : text) {
    const auto code = static_cast<unsigned char>(character);
    if (code >= 0x20 && code != 0x7f) {
      out += character;
    } else {
      (out.append("\\x") += digits[code >> 4U]) += digits[code & 15U];
    }
  }
  return out;
}

void print(std::FILE* file, const std::string& place, const std::string& code, const std::string& rule) {
  std::fprintf(file, "%s\n", printable(place + " " + code + " " + rule).c_str());
}

std::string position(const api::Refusal& not_json) {
  return "line " + std::to_string(not_json.line) + ", column " + std::to_string(not_json.column);
}

}  // namespace

ExitCode fail(const std::string& message, ExitCode code) {
  std::fprintf(stderr, "whittle: %s\n", message.c_str());
  return code;
}

ExitCode fail(const tracer::Failure& failure, const std::string& if_cancelled) {
  if (failure.code == tracer::Failure::Code::cancelled) return fail(if_cancelled, interrupted);
  if (failure.code != tracer::Failure::Code::bad_asset) return fail(failure.detail);
  print_issue(stderr, {failure.pointer, "bad_asset", failure.detail});
  return invalid_scene;
}

void print_issue(std::FILE* file, const tracer::Issue& issue) {
  print(file, api::uri_fragment(issue.pointer), issue.code, issue.detail);
}

std::vector<tracer::Issue> issues_of(const api::Refusal& refusal) {
  switch (refusal.kind) {
    case api::Refusal::Kind::not_json:
      return {{"", "not_json", position(refusal) + ": " + refusal.detail}};
    case api::Refusal::Kind::too_large:
      return {{"", "too_large", refusal.detail}};
    case api::Refusal::Kind::invalid:
      break;
  }
  return refusal.issues;
}

void print_issues(std::FILE* file, const api::Refusal& refusal) {
  if (refusal.kind == api::Refusal::Kind::not_json) return print(file, position(refusal), "not_json", refusal.detail);
  for (const tracer::Issue& issue : issues_of(refusal)) print_issue(file, issue);
}

void print_omitted(std::FILE* file, const std::vector<std::string>& omitted) {
  for (const std::string& sentence : omitted) std::fprintf(file, "%s\n", printable(sentence).c_str());
}

void print_warnings(std::FILE* file, const tracer::Scene& scene) {
  for (const tracer::Issue& warning : tracer::warnings(scene)) {
    std::fputs("warning ", file);
    print_issue(file, warning);
  }
}

}  // namespace cli
