/// The quick reader against nlohmann's parser, which is the judge: what it takes, it reads to the same tape.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "api/src/json/quick_reader.h"
#include "tests/reader/reading.h"

namespace {

using api::json::Kind;
using api::json::Node;
using api::json::Tape;
using reader_tests::file_bytes;
using namespace std::string_literals;

bool same_value(const Node& a, const Node& b) {
  if (a.kind != b.kind || a.size != b.size) return false;
  switch (a.kind) {
    case Kind::null:
      return true;
    case Kind::boolean:
      return a.truth == b.truth;
    case Kind::number:
      return std::bit_cast<std::uint64_t>(a.number) == std::bit_cast<std::uint64_t>(b.number);
    case Kind::string:
      return a.string() == b.string();
    case Kind::array:
    case Kind::object:
      break;
  }
  return a.end == b.end;
}

bool same(const Tape& a, const Tape& b) {
  if (a.nodes.size() != b.nodes.size()) return false;
  for (std::size_t i = 0; i < a.nodes.size(); ++i)
    if (!same_value(a.nodes[i], b.nodes[i])) return false;
  return true;
}

enum class Answer { taken, left, wrong };

/// Wrong: the quick reader takes what nlohmann's refuses, or reads something else in it.
Answer answer(std::string_view text, const api::DocumentLimits& limits = {}) {
  api::json::TapeWriter writer(text.size(), limits);
  if (!api::json::read_quickly(text, limits, writer)) return Answer::left;
  const auto judged = api::json::parse_by_library(text, limits);
  return judged && same(writer.tape, *judged) ? Answer::taken : Answer::wrong;
}

std::vector<std::string> documents() {
  std::vector<std::string> found;
  const std::filesystem::path scenes = std::filesystem::path(WHITTLE_SOURCE_DIR) / "scenes";
  for (const auto& folder : {scenes, scenes / "invalid"}) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() != ".json") continue;
      const std::string bytes = file_bytes(entry.path());
      if (bytes.size() < 20'000 && bytes.find('\0') == bytes.npos) found.push_back(bytes);
    }
  }
  return found;
}

TEST(QuickJson, TakesEveryKindOfValueAsTheJudgeDoes) {
  for (const std::string& text :
       {"null"s, " true "s, "false"s, "\"\""s, "[]"s, "{}"s, "[ ]"s, "{ }"s, "[[],{}]"s, "{\"\":0}"s,
        "{\"a\" : [1 , {\"b\":null}] , \"c\":\"d\"}"s, "\t[\r\n1\n]\n"s, "\xEF\xBB\xBF{}"s, "{\"a\":1,\"a\":2}"s})
    EXPECT_EQ(answer(text), Answer::taken) << text;
}

TEST(QuickJson, ReadsStringsWithEscapesAndBeyondAsciiAsTheJudgeDoes) {
  for (const std::string& text :
       {R"("\u00e9\n\/\\\"")"s, R"("\ud834\udd1e")"s, "\"\xC3\xA9 \xE2\x82\xAC \xF0\x9D\x84\x9E\""s, "\"\x7F\""s,
        R"({"\u0061":"b\\","c":"\""})"s, R"(["a\"b","\\",""])"s})
    EXPECT_EQ(answer(text), Answer::taken) << text;
  for (const std::string& text :
       {"\"\\ud834\""s, "\"\\x\""s, "\"\xC3\""s, "\"\xED\xA0\x80\""s, "\"\n\""s, "\"a"s, "\"a\\\""s, "\"\\"s, "\""s})
    EXPECT_EQ(answer(text), Answer::left) << text;
}

TEST(QuickJson, ReadsNumbersToTheSameBits) {
  for (const std::string& text :
       {"0"s, "-0"s, "-0.0"s, "-0e5"s, "1"s, "-1"s, "9007199254740993"s, "18446744073709551615"s,
        "18446744073709551617"s, "-9223372036854775809"s, "0.1"s, "1E+2"s, "0.5e-3"s, "1.7976931348623157e308"s,
        "2.2250738585072014e-308"s, "123456789012345678901234567890"s, "8.5e22"s, "0.30000000000000004441"s})
    EXPECT_EQ(answer("[" + text + "]"), Answer::taken) << text;
  for (const std::string& text : {"-"s, "+1"s, "01"s, "1."s, ".5"s, "1e"s, "1e+"s, "0x10"s, "1.5.5"s, "--1"s, "1 2"s,
                                  "NaN"s, "Infinity"s, "1e999"s})
    EXPECT_EQ(answer("[" + text + "]"), Answer::left) << text;
  std::mt19937_64 random(1);  // NOLINT: the same numbers every time
  for (int i = 0; i < 20'000; ++i) {
    char text[64];
    const auto value = std::bit_cast<double>(random());
    std::snprintf(text, sizeof text, "%.*g", 1 + i % 20, std::isfinite(value) ? value : 1.0);
    ASSERT_NE(answer(text), Answer::wrong) << text;
  }
}

TEST(QuickJson, LeavesWhatIsOverALimit) {
  const std::string text = R"({"keys":["four",1.25,[[0]]]})";
  ASSERT_EQ(answer(text), Answer::taken);
  std::vector<api::DocumentLimits> tight(5);
  tight[0].depth = 3;
  tight[1].values = 7;
  tight[2].string_bytes = 3;
  tight[3].key_bytes = 3;
  tight[4].number_chars = 3;
  for (const api::DocumentLimits& limits : tight) {
    EXPECT_EQ(answer(text, limits), Answer::left);
    EXPECT_FALSE(api::json::parse(text, limits)) << "the judge tells it";
  }
}

TEST(QuickJson, TakesEveryDocumentThatTheJudgeTakes) {
  for (const std::string& text : documents()) {
    const bool right = static_cast<bool>(api::json::parse_by_library(text, {}));
    // Numbers beyond doubles, which the judge reads as infinite in a second go.
    const bool huge = text.find("e400") != text.npos || text.find("e999") != text.npos;
    if (huge) continue;
    EXPECT_EQ(answer(text), right ? Answer::taken : Answer::left) << text.substr(0, 200);
  }
}

TEST(QuickJson, IsNeverWrongAboutDocumentsWithErrorsPutIn) {
  constexpr std::string_view pieces = "{}[]\",:\\.-+eE0159 \ntrufalsn\xC3\xA9\x80u";
  std::mt19937 random(2);  // NOLINT: the same errors every time
  const auto below = [&](std::size_t count) { return static_cast<std::size_t>(random() % count); };
  std::size_t taken = 0, left = 0;
  for (const std::string& original : documents()) {
    if (original.empty()) continue;
    for (int i = 0; i < 40; ++i) {
      std::string text = original;
      for (std::size_t edits = 1 + below(3); edits > 0 && !text.empty(); --edits) {
        const std::size_t at = below(text.size());
        if (below(3) == 0) {
          text.erase(at, 1);
        } else if (below(2) == 0) {
          text.insert(at, 1, pieces[below(pieces.size())]);
        } else {
          text[at] = pieces[below(pieces.size())];
        }
      }
      const Answer got = answer(text);
      ASSERT_NE(got, Answer::wrong) << text;
      ++(got == Answer::taken ? taken : left);
    }
  }
  EXPECT_GT(taken, 100u);
  EXPECT_GT(left, 100u);
}

}  // namespace
