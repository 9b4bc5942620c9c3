/// Both JSON parsers must give the same result for each document.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/reader/parsers_agree.h"
#include "tests/reader/reading.h"
#include "tests/support/effort.h"

namespace {

using reader_tests::disagreement;
using namespace std::string_literals;

std::vector<std::string> files_below(const std::filesystem::path& directory) {
  std::vector<std::string> contents;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    if (entry.path().extension() != ".json") continue;
    std::ifstream file(entry.path(), std::ios::binary);
    contents.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return contents;
}

const std::vector<std::string>& documents() {
  static const std::vector<std::string> all = [] {
    std::vector<std::string> found = files_below(WHITTLE_SOURCE_DIR "/scenes");
    for (auto& document : reader_tests::invalid_documents()) found.push_back(std::move(document.text));
    found.insert(found.end(), {"[-0, -0.0, 0e5, -0e-5, 0, -1, 1.5, 18446744073709551615, 18446744073709551616, 1e22]",
                               "[-9223372036854775808, 123456789012345678901234567890, 4.9e-324, 1e-400, 0.1e1]",
                               "[1e308, 1e309, -1e999]",
                               "\xEF\xBB\xBF[1]",
                               " \t\r\n[ 1 , 2 ]\n ",
                               "[1]x",
                               "[1] 2",
                               "[1",
                               "{\"a\":1,\"a\":2}",
                               R"({"\u0061\n\ud834\udd1e":"\"\\\/\b\f\r\t"})",
                               R"(["\ud834"])",
                               "[\"\x01\"]",
                               "[\"\xC3\"]",
                               "[[[[]]],{}]",
                               "[nul]",
                               "[nullx]",
                               "[truefalse]",
                               "[1.]",
                               "[01]",
                               "[1e]",
                               "[+1]",
                               "[-]",
                               "[.5]",
                               "[1,]",
                               "[,1]",
                               "{,}",
                               "{\"a\":}",
                               "{\"a\" 1}",
                               "{\"a\":1 \"b\":2}",
                               "[1 2]",
                               "[}",
                               "{]",
                               "",
                               " ",
                               "[]",
                               "{}"});
    return found;
  }();
  return all;
}

TEST(Parsers, AgreeOnEveryDocument) {
  ASSERT_GT(documents().size(), 900u);
  for (const std::string& text : documents()) EXPECT_EQ(disagreement(text, {}), "") << text.substr(0, 200);
}

TEST(Parsers, AgreeOnMutatedDocuments) {
  std::mt19937 random(5);
  const auto below = [&](std::size_t count) { return static_cast<std::size_t>(random() % count); };
  constexpr std::string_view pieces = "[]{}:,\"\\ \n0123456789-+.eEtrufalsn\x01\x7F\x80\xC3\xA9\xED";
  std::uint64_t valid = 0, invalid = 0;
  for (std::uint64_t i = 0; i < effort::cases(60'000); ++i) {
    std::string text = documents()[below(documents().size())];
    if (text.size() > 3000) continue;
    for (std::size_t changes = 1 + below(3); changes > 0 && !text.empty(); --changes) {
      const std::size_t at = below(text.size());
      switch (below(3)) {
        case 0:
          text[at] = pieces[below(pieces.size())];
          break;
        case 1:
          text.insert(at, 1, pieces[below(pieces.size())]);
          break;
        default:
          text.erase(at, 1 + below(3));
      }
    }
    ++(api::json::parse_with_simdjson(text, {}) ? valid : invalid);
    ASSERT_EQ(disagreement(text, {}), "") << text;
  }
  EXPECT_GT(valid, invalid / 20);
  EXPECT_GT(invalid, valid / 20);
}

TEST(Parsers, EnforceTheSameLimits) {
  api::DocumentLimits narrow;
  narrow.depth = 3;
  narrow.values = 6;
  narrow.string_bytes = 4;
  narrow.key_bytes = 2;
  narrow.number_chars = 5;
  for (const std::string text :
       {"[[[1]]]", "[[[[1]]]]", "[1,2,3,4,5]", "[1,2,3,4,5,6]", "[\"1234\"]", "[\"12345\"]", "[\"\\u00e9\\u00e9\"]",
        "{\"ab\":1}", "{\"abc\":1}", "[1.234]", "[1.2345]", "[1.234   ]", "[0.000]", "[0.0000]"})
    EXPECT_EQ(disagreement(text, narrow), "") << text;
}

TEST(Parsers, DelegateVeryDeepNestingToTheThoroughOne) {
  api::DocumentLimits deep;
  deep.depth = 1'000'000;
  const std::string nested = std::string(100'000, '[') + std::string(100'000, ']');
  EXPECT_FALSE(api::json::parse_with_simdjson(nested, deep));
  EXPECT_EQ(api::json::parse(nested, deep)->nodes.size(), 100'000u);
}

}  // namespace
