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

using namespace reader_tests;
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
  for (const char* text :
       {"null", " true ", "-0", "1E+2", "0.5e-3", "\"\"", "[]", "{}", "[[],{}]", "{\"\":0}", "{\"a\":[1,{\"b\":null}]}",
        "\"\\u00e9\\n\\/\\\\\"", "\"\\ud834\\udd1e\"", "\"\xC3\xA9 \xE2\x82\xAC \xF0\x9D\x84\x9E\"", "\"\x7F\"",
        "\t[\r\n1\n]", "\"\xF4\x8F\xBF\xBF\"", "\xEF\xBB\xBF{}"})
    EXPECT_TRUE(is_json(text)) << text;
}

TEST(JsonParser, DecodesEscapesInKeysAndStrings) {
  EXPECT_EQ(accepted(document_with(R"("n\u0061me": "\"\\\/\u00e9\u20ac\ud834\udd1e plain \u0041")")).scene.name,
            "\"\\/\xC3\xA9\xE2\x82\xAC\xF0\x9D\x84\x9E plain A");
}

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
  for (const char* text : {"1e-400", "1e-99999999999", "0e999", "0.0e-999", "0e99999999999", "0.000001e-320"})
    EXPECT_EQ(number_read_from(text), 0) << text;
}

TEST(JsonNumbers, MayOverflowOnlySixteenTimes) {
  std::string many = "1e999";
  for (int i = 0; i < 5000; ++i) many += ",1e999";
  EXPECT_EQ(outcome("[" + many + "]"), std::vector{"not_json 1:98"s});
}

TEST(JsonNumbers, EqualThoseOfStrtod) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 20'000; ++i) {
    const std::string text = std::to_string(random() % 100'000'000) + "." + std::to_string(random() % 100'000'000) +
                             "e" + std::to_string(static_cast<int>(random() % 60) - 30);
    EXPECT_EQ(number_read_from(text), std::strtod(text.c_str(), nullptr)) << text;
    const auto value = std::bit_cast<double>(random() & 0x7FFF'FFFF'FFFF'FFFF);
    if (!std::isfinite(value)) continue;
    for (const char* format : {"%.17g", "%.40e"}) {
      char digits[64];
      std::snprintf(digits, sizeof digits, format, value);
      EXPECT_EQ(number_read_from(digits), value) << digits;
    }
  }
}

#ifdef WHITTLE_JSON_TEST_SUITE
/// github.com/nst/JSONTestSuite, if a copy is installed.
TEST(JsonTestSuite, HasTheExpectedOutcomes) {
  std::size_t cases = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(WHITTLE_JSON_TEST_SUITE)) {
    const std::string name = entry.path().filename();
    if (!name.ends_with(".json")) continue;
    const bool taken = is_json(file_bytes(entry.path()));
    if (name.starts_with("y_") || name.starts_with("n_")) {
      EXPECT_EQ(taken, name.starts_with("y_")) << name;
    }
    ++cases;
  }
  EXPECT_GT(cases, 300u);
}
#endif

}  // namespace
