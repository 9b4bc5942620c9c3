#include <gtest/gtest.h>

#include <limits>

#include "server/telemetry/json_log.h"

namespace {

using telemetry::Field;
using telemetry::Level;

std::string line(std::string_view text) {
  const Field field{"detail", text};
  return telemetry::json_line(0, Level::info, "e", std::span(&field, 1));
}

/// The escaped text of `detail` in the line.
std::string escaped(std::string_view text) {
  const std::string prefix = "{\"time\":\"1970-01-01T00:00:00.000Z\",\"level\":\"info\",\"event\":\"e\",\"detail\":\"";
  const std::string whole = line(text);
  EXPECT_EQ(whole.substr(0, prefix.size()), prefix);
  EXPECT_EQ(whole.substr(whole.size() - 2), "\"}");
  return whole.substr(prefix.size(), whole.size() - prefix.size() - 2);
}

TEST(LogLine, HasTimeLevelEventAndTypedFields) {
  const std::vector<Field> fields{{"status", std::int64_t{200}}, {"duration_ms", 1.5}, {"ok", true}};
  EXPECT_EQ(telemetry::json_line(1'700'000'000'123, Level::warning, "request", fields),
            "{\"time\":\"2023-11-14T22:13:20.123Z\",\"level\":\"warning\",\"event\":\"request\",\"status\":200,"
            "\"duration_ms\":1.5,\"ok\":true}");
}

TEST(LogLine, EscapesControlCharacters) {
  EXPECT_EQ(escaped("a\r\nb"), "a\\u000d\\u000ab");
  EXPECT_EQ(escaped("\x1b[31mred"), "\\u001b[31mred");
  EXPECT_EQ(escaped(std::string_view("\0\x7f", 2)), "\\u0000\\u007f");
  EXPECT_EQ(escaped("\xc2\x9b"
                    "31m"),
            "\\u009b31m");
  EXPECT_EQ(escaped("\"\\"), "\\\"\\\\");
}

TEST(LogLine, PreservesUtf8AndReplacesInvalidBytes) {
  EXPECT_EQ(escaped("\xc3\xa9\xe2\x82\xac\xf0\x9f\x8e\xa8"), "\xc3\xa9\xe2\x82\xac\xf0\x9f\x8e\xa8");
  const std::string replaced = "\xef\xbf\xbd";
  EXPECT_EQ(escaped("a\xff"
                    "b"),
            "a" + replaced + "b");
  EXPECT_EQ(escaped("\xc0\xaf"), replaced + replaced);                 // overlong
  EXPECT_EQ(escaped("\xed\xa0\x80"), replaced + replaced + replaced);  // surrogate
  EXPECT_EQ(escaped("\xf4\x90\x80\x80"), replaced + replaced + replaced + replaced);
  EXPECT_EQ(escaped("\xe2\x82"), replaced + replaced);  // truncated
}

TEST(LogLine, TruncatesLongText) {
  const std::string text = escaped(std::string(5000, 'a'));
  EXPECT_EQ(text.size(), 4096U + 3);
  EXPECT_TRUE(text.ends_with("a..."));
}

TEST(LogLine, WritesNoNumberThatIsNotJson) {
  const Field field{"x", std::numeric_limits<double>::infinity()};
  EXPECT_TRUE(telemetry::json_line(0, Level::info, "e", std::span(&field, 1)).ends_with("\"x\":null}"));
}

TEST(LogLevel, IsParsedFromItsName) {
  for (const Level level : {Level::debug, Level::info, Level::warning, Level::error}) {
    EXPECT_EQ(telemetry::level_named(telemetry::name_of(level)), level);
  }
  EXPECT_FALSE(telemetry::level_named("loud"));
}

}  // namespace
