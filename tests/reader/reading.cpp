#include "tests/reader/reading.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>

#include "api/batch.h"
#include "api/measure_request.h"
#include "tracer/warnings.h"

namespace reader_tests {

std::string document_with(std::string_view members) {
  const std::string camera = R"({"version": 1, "camera": {"position": [0, 1, 6], "look_at": [0, 0, 0]})";
  return camera + (members.empty() ? "" : ", ") + std::string(members) + "}";
}

std::string document_with_object(std::string_view type, std::string_view members) {
  return document_with(R"("objects": [{"type": ")" + std::string(type) + R"(", "material": {}, )" +
                       std::string(members) + "}]");
}

std::vector<std::string> issue_lines(const std::vector<tracer::Issue>& issues) {
  std::vector<std::string> lines;
  for (const tracer::Issue& issue : issues) {
    lines.push_back((issue.pointer.empty() ? "\"\"" : issue.pointer) + " " + issue.code);
    EXPECT_FALSE(issue.detail.empty()) << lines.back();
  }
  return lines;
}

std::vector<std::string> warnings_of(const std::string& text) {
  return issue_lines(tracer::warnings(accepted(text).scene));
}

namespace {

template <class T>
std::vector<std::string> outcome_of(const tracer::Result<T, api::Refusal>& parsed) {
  if (parsed) return {"accepted"};
  const api::Refusal& refusal = parsed.error();
  if (refusal.kind == api::Refusal::Kind::too_large) return {"too_large"};
  if (refusal.kind == api::Refusal::Kind::not_json) {
    return {"not_json " + std::to_string(refusal.line) + ":" + std::to_string(refusal.column)};
  }
  return issue_lines(refusal.issues);
}

}  // namespace

std::vector<std::string> outcome(std::string_view text, const api::Limits& limits) {
  return outcome_of(api::parse_scene(text, limits));
}

std::vector<std::string> outcome(const InvalidDocument& document) {
  const std::string& text = document.text;
  if (document.request == "batch") return outcome_of(api::parse_batch(text, {}, [](const api::Frame&) {}));
  if (document.request == "measure") return outcome_of(api::parse_measure(text, {}));
  return outcome(text);
}

api::Document accepted(const std::string& text) {
  api::Limits limits;
  limits.files = api::Files::anywhere;
  auto document = api::parse_scene(text, limits);
  if (document) return std::move(*document);
  ADD_FAILURE() << "refused: " << document.error().detail << "\n" << text;
  for (const tracer::Issue& issue : document.error().issues) {
    ADD_FAILURE() << issue.pointer << " " << issue.code << ": " << issue.detail;
  }
  return {};
}

std::string only_detail(const std::string& text) {
  const auto document = api::parse_scene(text, {});
  if (document || document.error().issues.size() > 1) {
    ADD_FAILURE() << "expected exactly one issue of " << text;
    return {};
  }
  return document.error().issues.empty() ? document.error().detail : document.error().issues[0].detail;
}

std::string file_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<InvalidDocument> invalid_documents() {
  FILE* const pipe = popen("'" WHITTLE_PYTHON "' '" WHITTLE_SOURCE_DIR "/tests/reader/invalid_documents.py'", "r");
  std::string printed;
  std::array<char, 65536> chunk{};
  while (const std::size_t size = std::fread(chunk.data(), 1, chunk.size(), pipe)) printed.append(chunk.data(), size);
  EXPECT_EQ(pclose(pipe), 0);
  std::vector<InvalidDocument> documents;
  std::istringstream stream(printed);
  InvalidDocument document;
  std::size_t bytes = 0, lines = 0;
  while (stream >> document.name >> document.request >> bytes >> lines && stream.get() == '\n') {
    std::getline(stream, document.detail);
    document.outcome.resize(lines);
    for (std::string& line : document.outcome) std::getline(stream, line);
    document.text.resize(bytes);
    stream.read(document.text.data(), static_cast<std::streamsize>(bytes));
    documents.push_back(document);
  }
  return documents;
}

}  // namespace reader_tests
