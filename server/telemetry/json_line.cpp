#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "server/telemetry/json_log.h"

namespace telemetry {
namespace {

constexpr std::size_t text_bytes_max = 4096;

/// Length of the well-formed UTF-8 sequence that starts `text`, or 0 (Unicode 15, table 3-7).
std::size_t utf8_sequence(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const auto within = [&](std::size_t i, unsigned low, unsigned high) {
    return i < text.size() && byte(i) >= low && byte(i) <= high;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first <= 0xdf) return within(1, 0x80, 0xbf) ? 2 : 0;
  if (first >= 0xe0 && first <= 0xef) {
    const unsigned low = first == 0xe0 ? 0xa0 : 0x80, high = first == 0xed ? 0x9f : 0xbf;
    return within(1, low, high) && within(2, 0x80, 0xbf) ? 3 : 0;
  }
  if (first >= 0xf0 && first <= 0xf4) {
    const unsigned low = first == 0xf0 ? 0x90 : 0x80, high = first == 0xf4 ? 0x8f : 0xbf;
    return within(1, low, high) && within(2, 0x80, 0xbf) && within(3, 0x80, 0xbf) ? 4 : 0;
  }
  return 0;
}

void append_escape(std::string& line, unsigned code) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "\\u%04x", code);
  line += text.data();
}

void append_text(std::string& line, std::string_view text) {
  const bool cut = text.size() > text_bytes_max;
  if (cut) text = text.substr(0, text_bytes_max);
  line += '"';
  while (!text.empty()) {
    const std::size_t length = utf8_sequence(text);
    const auto first = static_cast<unsigned char>(text[0]);
    // C1 controls (U+0080..U+009F) are escape sequences to some terminals.
    const bool c1 = length == 2 && first == 0xc2 && static_cast<unsigned char>(text[1]) < 0xa0;
    if (length == 0) {
      line += "\xef\xbf\xbd";  // U+FFFD for the byte that is no UTF-8
    } else if (first == '"' || first == '\\') {
      line += '\\';
      line += text[0];
    } else if (first < 0x20 || first == 0x7f) {
      append_escape(line, first);
    } else if (c1) {
      append_escape(line, static_cast<unsigned char>(text[1]));
    } else {
      line += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  line += cut ? "...\"" : "\"";
}

void append_number(std::string& line, double value) {
  if (!std::isfinite(value)) {
    line += "null";  // JSON has no infinities
    return;
  }
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  line += text.data();
}

void append_time(std::string& line, std::int64_t unix_ms) {
  const std::time_t seconds = unix_ms / 1000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 24> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  std::array<char, 8> fraction{};
  std::snprintf(fraction.data(), fraction.size(), ".%03dZ", static_cast<int>(unix_ms % 1000));
  line += '"';
  line += date.data();
  line += fraction.data();
  line += '"';
}

}  // namespace

std::string_view name_of(Level level) {
  constexpr std::array<std::string_view, 4> names{"debug", "info", "warning", "error"};
  return names[static_cast<std::size_t>(level)];
}

std::optional<Level> level_named(std::string_view name) {
  for (const Level candidate : {Level::debug, Level::info, Level::warning, Level::error}) {
    if (name_of(candidate) == name) return candidate;
  }
  return std::nullopt;
}

std::string json_line(std::int64_t unix_ms, Level level, std::string_view event, std::span<const Field> fields) {
  std::string line = "{\"time\":";
  append_time(line, unix_ms);
  line += ",\"level\":";
  append_text(line, name_of(level));
  line += ",\"event\":";
  append_text(line, event);
  for (const Field& field : fields) {
    line += ',';
    append_text(line, field.name);
    line += ':';
    if (const auto* text = std::get_if<std::string_view>(&field.value)) append_text(line, *text);
    if (const auto* count = std::get_if<std::int64_t>(&field.value)) line += std::to_string(*count);
    if (const auto* number = std::get_if<double>(&field.value)) append_number(line, *number);
    if (const auto* truth = std::get_if<bool>(&field.value)) line += *truth ? "true" : "false";
  }
  return line + '}';
}

}  // namespace telemetry
