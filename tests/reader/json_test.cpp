/// The JSON parser: accepted and rejected texts, numbers to the last bit, and JSONTestSuite if it is installed.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "tests/reader/reading.h"

namespace {

using reader_tests::accepted;
using reader_tests::document_with;
using reader_tests::outcome;
using namespace std::string_literals;

bool is_json(std::string_view text) {
  api::Limits deep;
  deep.document.depth = 1'000'000;  // nesting alone does not make a text no JSON
  deep.document.number_chars = 1'000;
  return !outcome(text, deep)[0].starts_with("not_json");
}

double number_read_from(const std::string& text) {
  return accepted(document_with(R"("materials": {"m": {"shininess": )" + text + "}}")).scene.materials.at(0).shininess;
}

TEST(JsonParser, AcceptsJson) {
  const std::vector<std::string> texts = {"null",
                                          " true ",
                                          "-0",
                                          "1E+2",
                                          "0.5e-3",
                                          "\"\"",
                                          "[]",
                                          "{}",
                                          "[[],{}]",
                                          "{\"\":0}",
                                          "{\"a\":[1,{\"b\":null}]}",
                                          "\"\\u00e9\\n\\/\\\\\"",
                                          "\"\\ud834\\udd1e\"",
                                          "\"\xC3\xA9 \xE2\x82\xAC \xF0\x9D\x84\x9E\"",
                                          "\"\x7F\"",
                                          "\t[\r\n1\n]",
                                          "\"\xF4\x8F\xBF\xBF\"",
                                          "\xEF\xBB\xBF{}"};
  for (const std::string& text : texts) EXPECT_TRUE(is_json(text)) << text;
}

TEST(JsonParser, RejectsOtherTexts) {
  const std::vector<std::string> texts = {"",
                                          " ",
                                          "nul",
                                          "True",
                                          "NaN",
                                          "-",
                                          "+1",
                                          "01",
                                          "-01",
                                          "1.",
                                          ".5",
                                          "1e",
                                          "1e+",
                                          "0x1",
                                          "1_000",
                                          "[1,]",
                                          "[,1]",
                                          "[1 2]",
                                          "{\"a\"}",
                                          "{\"a\":}",
                                          "{\"a\":1,}",
                                          "{a:1}",
                                          "{'a':1}",
                                          "[1]]",
                                          "{}{}",
                                          "[}",
                                          "\"",
                                          "\"\\\"",
                                          "\"\\a\"",
                                          "\"\\u12\"",
                                          "\"\\ud800\"",
                                          "\"\\udc00\"",
                                          "\"\\ud800\\u0041\"",
                                          "\"\n\"",
                                          "\"\x80\"",
                                          "\"\xC0\x80\"",
                                          "\"\xED\xA0\x80\"",
                                          "\"\xF5\x80\x80\x80\"",
                                          "\"\xF4\x90\x80\x80\"",
                                          "\"\xE2\x82\"",
                                          "\xEF\xBB\xBF",
                                          "\xEF\xBB{}",
                                          "/**/1",
                                          "1//",
                                          "[1]\f"s,
                                          "\0"s,
                                          "1\0"s,
                                          "[\0]"s,
                                          "\xFE\xFF\0{\0}"s,
                                          "\xFF\xFE{\0}\0"s};
  for (const std::string& text : texts) EXPECT_FALSE(is_json(text)) << text;
}

TEST(JsonParser, QuotesTheUnexpectedText) {
  const auto detail = [](std::string_view text) { return api::parse_scene(text, {}).error().detail; };
  EXPECT_EQ(detail("{\"version\": NaN}"), "syntax error while parsing value - invalid literal, found 'NaN'");
  EXPECT_EQ(detail("[1, 2"),
            "syntax error while parsing array - unexpected end of input; expected ']', found the end of the document");
  EXPECT_EQ(detail("[1; 2]"), "syntax error while parsing array - invalid literal, found ';'");
  EXPECT_EQ(
      detail("{\"a\": 1,\n}"),
      "syntax error while parsing object key - unexpected '}'; expected string literal, found '}': a comma before "
      "}, which the last member must not have");
  EXPECT_TRUE(detail("[1, ]").ends_with("found ']': a comma before ], which the last element must not have"));
  EXPECT_TRUE(detail("{ // the version\n}").ends_with(": JSON has no comments"));
  EXPECT_TRUE(detail("['a']").ends_with(": write text in double quotes"));
  EXPECT_TRUE(detail("{version: 1}").ends_with(": write names in double quotes"));
  EXPECT_TRUE(detail("{\"a\": 1 \"b\": 2}").ends_with(": is a comma missing before it?"));
  EXPECT_EQ(detail("{\"a\": \x01}"), "syntax error while parsing value - invalid literal, found byte 0x01");
}

TEST(JsonParser, CountsLinesFromOneAndColumnsInBytes) {
  EXPECT_EQ(outcome("{\n  \"name\": \"\xC3\xA9\" x"), std::vector{"not_json 2:16"s});
  EXPECT_EQ(outcome("\r\n\r\n!"), std::vector{"not_json 3:1"s});
}

TEST(JsonParser, DecodesEscapesInStrings) {
  EXPECT_EQ(accepted(document_with(R"("name": "\"\\\/\u00e9\u20ac\ud834\udd1e plain \u0041")")).scene.name,
            "\"\\/\xC3\xA9\xE2\x82\xAC\xF0\x9D\x84\x9E plain A");
}

TEST(JsonParser, DecodesEscapesInKeys) { EXPECT_EQ(accepted(document_with(R"("n\u0061me": "x")")).scene.name, "x"); }

TEST(JsonParser, EnforcesEachLimit) {
  api::Limits narrow;
  narrow.document.depth = 3;
  narrow.document.values = 6;
  narrow.document.string_bytes = 4;
  narrow.document.key_bytes = 2;
  narrow.document.number_chars = 5;
  for (const char* text :
       {"[[[1]]]", "[1,2,3,4,5]", "[\"1234\"]", "[\"\\u00e9\\u00e9\"]", "{\"ab\":1}", "[1.234   ]", "[0.000]"})
    EXPECT_NE(outcome(text, narrow)[0], "too_large") << text;
  for (const char* text :
       {"[[[[1]]]]", "[1,2,3,4,5,6]", "[\"12345\"]", "{\"abc\":1}", "[1.2345]", "[0.0000]", "[1e9999]"})
    EXPECT_EQ(outcome(text, narrow), std::vector{"too_large"s}) << text;
}

TEST(JsonNumbers, AreTheNearestDoubles) {
  EXPECT_EQ(number_read_from("0.1"), 0.1);
  EXPECT_EQ(number_read_from("123456789012345678"), 123456789012345678.0);
  EXPECT_EQ(number_read_from("9007199254740993"), 9007199254740992.0);
  EXPECT_EQ(number_read_from("9007199254740993.00000000000000000001"), 9007199254740994.0);
  EXPECT_EQ(number_read_from("2.2250738585072011e-308"), 2.2250738585072011e-308);
  EXPECT_EQ(number_read_from("1.7976931348623157e308"), 1.7976931348623157e308);
  EXPECT_EQ(number_read_from("4.9e-324"), 4.9e-324);
  EXPECT_EQ(number_read_from("8.41e21"), 8.41e21);
  EXPECT_EQ(number_read_from("9007199254740991e22"), 9007199254740991e22);
  EXPECT_EQ(number_read_from("0.000000000000000000000000000000012345"), 1.2345e-32);
}

TEST(JsonNumbers, UnderflowToZero) {
  for (const char* text : {"1e-400", "1e-99999999999", "0e999", "0.0e-999", "0e99999999999", "0.000001e-320"}) {
    EXPECT_EQ(number_read_from(text), 0) << text;
  }
}

TEST(JsonNumbers, AreNotFiniteIfTheyOverflow) {
  for (const char* text : {"1e999", "-1e999", "1e99999999999", "1.8e308", "123456789e301", "0.001e312"}) {
    const std::string document = document_with(R"("materials": {"m": {"shininess": )" + std::string(text) + "}}");
    EXPECT_EQ(outcome(document), std::vector{"/materials/m/shininess not_finite"s}) << text;
  }
}

TEST(JsonNumbers, DoNotHideOtherIssuesIfTheyOverflow) {
  const std::string document = document_with(R"("ambient": 1e999, "colour": 1, "background": {"color": -1e400})");
  EXPECT_EQ(outcome(document),
            (std::vector{"/ambient not_finite"s, "/colour unknown_field"s, "/background/color not_finite"s}));
}

TEST(JsonNumbers, MayOverflowOnlySixteenTimes) {
  std::string many = "1e999";
  for (int i = 0; i < 5000; ++i) many += ",1e999";
  EXPECT_EQ(outcome("[" + many + "]"), std::vector{"not_json 1:98"s});
}

TEST(JsonNumbers, RoundTripFromShortAndLongText) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 20'000; ++i) {
    const auto value = std::bit_cast<double>(random() & 0x7FFF'FFFF'FFFF'FFFF);
    if (!std::isfinite(value)) continue;
    char shortest[40], longest[64];
    std::snprintf(shortest, sizeof shortest, "%.17g", value);
    std::snprintf(longest, sizeof longest, "%.40e", value);
    EXPECT_EQ(number_read_from(shortest), value) << shortest;
    EXPECT_EQ(number_read_from(longest), value) << longest;
  }
}

TEST(JsonNumbers, EqualThoseOfStrtod) {
  std::mt19937_64 random(8);
  for (int i = 0; i < 20'000; ++i) {
    const std::string text = std::to_string(random() % 100'000'000) + "." + std::to_string(random() % 100'000'000) +
                             "e" + std::to_string(static_cast<int>(random() % 60) - 30);
    EXPECT_EQ(number_read_from(text), std::strtod(text.c_str(), nullptr)) << text;
  }
}

#ifdef WHITTLE_JSON_TEST_SUITE
/// github.com/nst/JSONTestSuite, if a copy is installed.
TEST(JsonTestSuite, HasTheExpectedOutcomes) {
  std::size_t cases = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(WHITTLE_JSON_TEST_SUITE)) {
    const std::string name = entry.path().filename();
    if (!name.ends_with(".json")) continue;
    const bool taken = is_json(reader_tests::file_bytes(entry.path()));
    if (name.starts_with("y_") || name.starts_with("n_")) {
      EXPECT_EQ(taken, name.starts_with("y_")) << name;
    }
    ++cases;
  }
  EXPECT_GT(cases, 300u);
}
#endif

}  // namespace
